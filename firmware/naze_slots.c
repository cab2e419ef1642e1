/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "naze_slots.h"

#include <string.h>

#define SEAL 0x0000u /* differs from every erased or partly programmed state */

enum { MAGIC_AT = 0, COUNT_AT = 2, SEQUENCE_AT = 4, CHECKSUM_AT = 8, HEADER_CHECKSUM_AT = 12, SEAL_AT = 16 };

/* Half a byte at a time: 64 bytes of table. */
uint32_t nm_crc32(uint32_t checksum, const uint8_t *data, uint32_t length)
{
    static const uint32_t table[16] = {
        0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
        0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu,
    };
    uint32_t crc = ~checksum;
    while (length--) {
        crc ^= *data++;
        crc = crc >> 4 ^ table[crc & 15u];
        crc = crc >> 4 ^ table[crc & 15u];
    }
    return ~crc;
}

static const uint8_t *slot_flash(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    return flash->flash(self) + slot->page * NS_PAGE_SIZE;
}

const uint8_t *ns_header(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    return slot_flash(flash, self, slot) + slot->header;
}

const uint8_t *ns_data(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    return slot_flash(flash, self, slot) + slot->data;
}

uint16_t ns_count(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    return ns_get16(ns_header(flash, self, slot) + COUNT_AT);
}

uint32_t ns_sequence(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    return ns_get32(ns_header(flash, self, slot) + SEQUENCE_AT);
}

uint32_t ns_checksum(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    return ns_get32(ns_header(flash, self, slot) + CHECKSUM_AT);
}

bool ns_valid(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    const uint8_t *header = ns_header(flash, self, slot);
    const uint16_t count = ns_get16(header + COUNT_AT);
    return ns_get16(header + MAGIC_AT) == NS_MAGIC && ns_get16(header + SEAL_AT) == SEAL && count <= slot->capacity &&
           ns_get32(header + HEADER_CHECKSUM_AT) == nm_crc32(0, header, HEADER_CHECKSUM_AT) &&
           ns_get32(header + CHECKSUM_AT) == nm_crc32(0, ns_data(flash, self, slot), (uint32_t)count * slot->unit);
}

bool ns_blank(const uint8_t *bytes, uint16_t length)
{
    while (length--)
        if (*bytes++ != 0xFF)
            return false;
    return true;
}

bool ns_erase(const ns_flash_t *flash, void *self, const ns_slot_t *slot)
{
    for (uint8_t page = 0; page < slot->pages; page++) {
        const uint8_t *bytes = slot_flash(flash, self, slot) + page * NS_PAGE_SIZE;
        if (ns_blank(bytes, NS_PAGE_SIZE))
            continue;
        if (!flash->erase(self, (uint8_t)(slot->page + page)) || !ns_blank(bytes, NS_PAGE_SIZE))
            return false;
    }
    return true;
}

bool ns_program(const ns_flash_t *flash, void *self, const ns_slot_t *slot, uint16_t at, const uint8_t *data, uint16_t length)
{
    return flash->program(self, (uint16_t)(slot->page * NS_PAGE_SIZE + at), data, length) &&
           memcmp(slot_flash(flash, self, slot) + at, data, length) == 0;
}

bool ns_seal(const ns_flash_t *flash, void *self, const ns_slot_t *slot, uint16_t count, uint32_t sequence)
{
    uint8_t header[NS_HEADER_SIZE];
    ns_put16(header + MAGIC_AT, NS_MAGIC);
    ns_put16(header + COUNT_AT, count);
    ns_put32(header + SEQUENCE_AT, sequence);
    ns_put32(header + CHECKSUM_AT, nm_crc32(0, ns_data(flash, self, slot), (uint32_t)count * slot->unit));
    ns_put32(header + HEADER_CHECKSUM_AT, nm_crc32(0, header, HEADER_CHECKSUM_AT));
    ns_put16(header + SEAL_AT, SEAL);
    if (!ns_program(flash, self, slot, slot->header, header, SEAL_AT))
        return false;
    if (ns_program(flash, self, slot, (uint16_t)(slot->header + SEAL_AT), header + SEAL_AT, NS_HEADER_SIZE - SEAL_AT))
        return true;
    /* A seal that reads wrong now might read right at the next start: invalidate the slot. */
    (void)flash->erase(self, (uint8_t)(slot->page + slot->header / NS_PAGE_SIZE));
    return false;
}
