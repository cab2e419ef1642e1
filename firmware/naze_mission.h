/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Mission lists over MSP: the flight controller's side of docs/msp-mission.md, version 1.
 *
 * The core takes an MSP command with its payload and returns the reply's payload. It does not depend on serial ports or on
 * the firmware around it, and its only time is a millisecond counter. No heap, no float, no globals: the caller owns all
 * state, one nm_t (48 bytes on a 32 bit target). It calls the board through an nm_board_t.
 *
 * THE FLASH
 *   NM_PAGES pages of NM_PAGE_SIZE bytes, two slots of NM_SLOT_PAGES each (naze_slots.h), written in turn. A slot's header is
 *   at its beginning; its records of 16 bytes begin at NM_RECORDS_OFFSET. The sequence is 1 for the first list ever written,
 *   and one more for each.
 *
 *   Of two valid slots, the later sequence is in use. The slot in use is never touched: BEGIN erases the other one, CHUNK
 *   programs its records directly, COMMIT its header and then the seal. So a power cut at any moment leaves the complete old
 *   or new list, and staging needs no RAM.
 *
 *   Wear: a list costs at most one erase of one slot, so 10,000 erase cycles last for 20,000 different lists. Pages that
 *   read blank are not erased, and a list that is already stored is not written again. nm_t.sequence (INFO's last field)
 *   counts the lists written.
 *
 *   A companion stuck in a loop must not wear out the flash: BEGINs that need an erase and requests that write the
 *   configuration (nm_spend_write()) share a budget of NM_WRITE_BURST writes after a reset and one more every
 *   NM_WRITE_INTERVAL_MS, up to NM_WRITE_BURST again. With the budget spent they return NM_BUSY, and INFO reports it (flag
 *   bit 3). At that rate 10,000 erases take 34 days of continuous power. nm_store() is not limited: it must not lose a list.
 *
 * USE
 *   nm_start() once, when the flash can be read; nm_poll() in every main loop; nm_handle() for every valid MSP request with an
 *   unknown command; nm_store() wherever the firmware saves a list that it received by other means. Call all from one
 *   context, never from an interrupt. The core is not reentrant for one nm_t.
 *
 * TIME
 *   On an STM32F103: BEGIN erases up to three pages of 20..40 ms each. A full CHUNK programs 120 half-words of 52..70 us each,
 *   under 9 ms. Meanwhile a CPU that runs from the same flash is stalled, interrupts included: ticks of the clock are lost.
 *   A CRC over a full list takes 2 ms. While armed, the core neither writes to the flash nor computes a CRC.
 *
 * STACK
 *   Under 200 bytes below nm_handle() on Cortex-M3, without the board's functions (`make test-arm` measures it).
 */
#ifndef NAZE_MISSION_H
#define NAZE_MISSION_H

#include "naze_slots.h"

#include <stdbool.h>
#include <stdint.h>

#define NM_VERSION 1u

#define NM_RECORD_SIZE 16u
#define NM_CAPACITY 146u       /* records in a list, as in Harakiri's FloppyDisk */
#define NM_CHUNK_RECORDS 15u   /* most records in one CHUNK */
#define NM_CHUNK_WINDOW 2u     /* most unanswered CHUNKs: while one is programmed (9 ms), 104 of the ring's 256 bytes arrive */
#define NM_READ_RECORDS 6u     /* most records in one READ: two replies fit the 255 bytes of the transmit ring */
#define NM_BYTE_TIMEOUT_MS 50u /* the receiver's inter-byte timeout: reported by INFO, kept by the receiver */
#define NM_IDLE_TIMEOUT_MS 5000u
#define NM_MAX_RADIUS_CM 2000u
#define NM_WRITE_BURST 250u    /* flash writes that requests may cause in a row: more than a day of testing missions needs */
#define NM_WRITE_INTERVAL_MS 300000u /* ... and the interval at which one more is allowed */

#define NM_PAGE_SIZE NS_PAGE_SIZE
#define NM_SLOT_PAGES 3u
#define NM_SLOT_SIZE (NM_SLOT_PAGES * NM_PAGE_SIZE)
#define NM_SLOTS 2u
#define NM_PAGES (NM_SLOTS * NM_SLOT_PAGES)
#define NM_FLASH_SIZE (NM_PAGES * NM_PAGE_SIZE)
#define NM_RECORDS_OFFSET 32u

/* The largest payload either way: a full CHUNK is 1 mask + 2 first + 15 records. nm_handle()'s buffer must hold it. */
#define NM_BUFFER_SIZE (1u + 2u + NM_CHUNK_RECORDS * NM_RECORD_SIZE)

/* MSP commands. */
enum {
    NM_INFO = 190,
    NM_BEGIN = 191,
    NM_CHUNK = 192,
    NM_COMMIT = 193,
    NM_ABORT = 194,
    NM_READ = 195,
    NM_RADIUS = 196
};

/* First byte of every reply. */
typedef enum {
    NM_OK = 0,
    NM_SAME = 1,
    NM_ARMED = 2,
    NM_BUSY = 3,
    NM_NO_TRANSFER = 4,
    NM_SEQUENCE = 5,
    NM_NO_SPACE = 6,
    NM_RANGE = 7,
    NM_CHECKSUM = 8,
    NM_INCOMPLETE = 9,
    NM_FLASH = 10,
    NM_BAD_REQUEST = 11,
    NM_BAD_RECORD = 12
} nm_status_t;

/* The board's functions. `self` is the pointer given to nm_start(), for the board's own use. */
typedef struct {
    ns_flash_t flash; /* NM_PAGES pages */
    /* A counter of milliseconds that may wrap at 2^32. */
    uint32_t (*millis)(void *self);
    bool (*armed)(void *self);
    /* A write of the configuration is scheduled or running. */
    bool (*write_pending)(void *self);
    /* gps_wp_radius, cm. */
    uint16_t (*radius)(void *self);
    /* Set a new gps_wp_radius and have it stored with the configuration. Called for changes only. */
    void (*set_radius)(void *self, uint16_t radius_cm);
    /* A COMMIT has made another list the stored one: `records` points into the flash. */
    void (*list_changed)(void *self, const uint8_t *records, uint16_t count);
} nm_board_t;

/* A list: the number of records, and the CRC-32 over their bytes. */
typedef struct {
    uint32_t checksum;
    uint16_t count;
} nm_list_t;

/* All of the core's state. Fields are for reading only. */
typedef struct {
    const nm_board_t *board;
    void *self;
    nm_list_t stored;     /* the list in the slot in use; empty if there is none */
    nm_list_t wanted;     /* the open transfer: the list announced by BEGIN, */
    nm_list_t staged;     /* ... the records already in the other slot, */
    uint32_t heard_ms;    /* ... and the time of its last request */
    uint32_t sequence;    /* of the slot in use; 0 if there is none */
    uint32_t credited_ms; /* when the write budget last grew, or would have grown if not full */
    uint8_t slot;         /* the slot in use: 0, 1, or NM_SLOTS if there is none */
    uint8_t writes_left;  /* in the budget */
    bool open;            /* a transfer is open */
} nm_t;

/* Find the newest valid list. Reads flash only. `board` and `self` must live as long as `m` is used. */
void nm_start(nm_t *m, const nm_board_t *board, void *self);

/* Drop an open transfer if the craft is armed or after 5 s without a request; let the write budget grow. */
void nm_poll(nm_t *m);

/*
 * Answer one request. `buffer` holds its payload of `size` bytes and takes the reply's payload; it has room for
 * NM_BUFFER_SIZE bytes. Returns the reply's length, or -1 if the command is not one of the above (buffer untouched).
 */
int nm_handle(nm_t *m, uint8_t command, uint8_t *buffer, uint8_t size);

/*
 * Make `count` records the stored list, as COMMIT does, for lists that the firmware received without this extension.
 * Returns NM_OK or NM_FLASH (the old list is whole), which drop an open transfer; NM_SAME, NM_ARMED or NM_NO_SPACE, which
 * change nothing.
 */
nm_status_t nm_store(nm_t *m, const uint8_t *records, uint16_t count);

/* Take a flash write from the budget. False if it is spent. */
bool nm_spend_write(nm_t *m);

/* Unmask a request's payload in place. Returns the body's length (the body begins at payload + 1), or 0 if it is not masked. */
uint8_t nm_unmask(uint8_t *payload, uint8_t size);

/* The stored list's nm_t.stored.count records, in flash. NULL if there has never been a list. */
const uint8_t *nm_records(const nm_t *m);

#endif
