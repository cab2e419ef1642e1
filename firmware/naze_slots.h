/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Flash slots whose contents are either complete or invalid, whenever the power is cut. The mission core keeps its lists in two
 * of them, and Harakiri's side its configuration (harakiri_config.h).
 *
 * A slot is some pages with data and a header of NS_HEADER_SIZE bytes, each anywhere in them:
 *
 *       0  u16  magic, NS_MAGIC
 *       2  u16  count of units of data (a list's records, a configuration's bytes)
 *       4  u32  sequence: of two slots with the same contents, the later one is newer (serial number arithmetic)
 *       8  u32  CRC-32 of the data
 *      12  u32  CRC-32 of the 12 bytes before
 *      16  u16  seal, 0000: programmed last, after all else has been read back
 *
 * A slot is valid only if all of this is right. To change a slot: ns_erase(), ns_program() its data, ns_seal(). Every program
 * and erase operation is verified by reading back.
 *
 * Pages that read blank are not erased. Weak bits: a page whose erase was cut short can read blank, and a bit of it can change
 * later; then the CRC is wrong, and the slot is invalid.
 */
#ifndef NAZE_SLOTS_H
#define NAZE_SLOTS_H

#include <stdbool.h>
#include <stdint.h>

#define NS_PAGE_SIZE 1024u
#define NS_MAGIC 0x4D4Eu /* "NM" */
#define NS_HEADER_SIZE 18u

/* A flash of pages. `self` is the pointer that the functions below are given, for the board's own use. */
typedef struct {
    /* Erase a page to FF. False if the flash controller reported an error; it is verified in any case. */
    bool (*erase)(void *self, uint8_t page);
    /* Program `length` (even) bytes at the even `offset`, half-word by half-word, in ascending order. */
    bool (*program)(void *self, uint16_t offset, const uint8_t *data, uint16_t length);
    /* The address at which page 0 can be read. Keep its value from the optimizer (volatile): it may move a read of a known
       address across the register accesses that erase a page there. */
    const uint8_t *(*flash)(void *self);
} ns_flash_t;

/* Where a slot lies in the flash. */
typedef struct {
    uint8_t page;      /* its first page */
    uint8_t pages;     /* ... and their number */
    uint16_t header;   /* the offset of its header */
    uint16_t data;     /* ... and of its data */
    uint16_t unit;     /* the size of a unit of data */
    uint16_t capacity; /* the most units */
} ns_slot_t;

/* Its header and its data. */
const uint8_t *ns_header(const ns_flash_t *flash, void *self, const ns_slot_t *slot);
const uint8_t *ns_data(const ns_flash_t *flash, void *self, const ns_slot_t *slot);

/* The fields of a valid slot's header. */
uint16_t ns_count(const ns_flash_t *flash, void *self, const ns_slot_t *slot);
uint32_t ns_sequence(const ns_flash_t *flash, void *self, const ns_slot_t *slot);
uint32_t ns_checksum(const ns_flash_t *flash, void *self, const ns_slot_t *slot);

bool ns_valid(const ns_flash_t *flash, void *self, const ns_slot_t *slot);

/* True if `length` bytes are erased. */
bool ns_blank(const uint8_t *bytes, uint16_t length);

/* Erase the pages that are not blank, the first one first. */
bool ns_erase(const ns_flash_t *flash, void *self, const ns_slot_t *slot);

/* Program erased bytes at an offset of the slot. */
bool ns_program(const ns_flash_t *flash, void *self, const ns_slot_t *slot, uint16_t at, const uint8_t *data, uint16_t length);

/* Make a slot valid whose `count` units of data have been programmed. */
bool ns_seal(const ns_flash_t *flash, void *self, const ns_slot_t *slot, uint16_t count, uint32_t sequence);

/* Continue a CRC-32 whose value so far is `checksum`, initially 0. */
uint32_t nm_crc32(uint32_t checksum, const uint8_t *data, uint32_t length);

/* Little-endian numbers. */
static inline uint16_t ns_get16(const uint8_t *from)
{
    return (uint16_t)(from[0] | (unsigned)from[1] << 8);
}

static inline uint32_t ns_get32(const uint8_t *from)
{
    return ns_get16(from) | (uint32_t)ns_get16(from + 2) << 16;
}

static inline void ns_put16(uint8_t *to, uint16_t value)
{
    to[0] = (uint8_t)value;
    to[1] = (uint8_t)(value >> 8);
}

static inline void ns_put32(uint8_t *to, uint32_t value)
{
    ns_put16(to, (uint16_t)value);
    ns_put16(to + 2, (uint16_t)(value >> 16));
}

#endif
