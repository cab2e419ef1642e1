/* SPDX-License-Identifier: GPL-3.0-or-later */
/* See naze_mission.h, which is the manual, and docs/msp-mission.md, which is the specification. */
#include "naze_mission.h"

#include <stddef.h>
#include <string.h>

enum { COMMAND_AT = 15, LAST_COMMAND = 7 }; /* in a record */

enum { INFO_SIZE = 24, LIST_SIZE = 7, ABORT_SIZE = 1, READ_SIZE = 3, RADIUS_SIZE = 3 }; /* of replies, READ's without records */

static bool same(nm_list_t one, nm_list_t other)
{
    return one.count == other.count && one.checksum == other.checksum;
}

/* ---- slots ------------------------------------------------------------------------------------------------------------ */

static const ns_slot_t slots[NM_SLOTS] = {
    {0, NM_SLOT_PAGES, 0, NM_RECORDS_OFFSET, NM_RECORD_SIZE, NM_CAPACITY},
    {NM_SLOT_PAGES, NM_SLOT_PAGES, 0, NM_RECORDS_OFFSET, NM_RECORD_SIZE, NM_CAPACITY},
};

static uint8_t unused_slot(const nm_t *m)
{
    return m->slot == 0 ? 1 : 0;
}

static const uint8_t *slot_flash(const nm_t *m, uint8_t slot)
{
    return ns_header(&m->board->flash, m->self, &slots[slot]);
}

static uint32_t checksum_in_slot(const nm_t *m, uint8_t slot, uint16_t count)
{
    return nm_crc32(0, slot_flash(m, slot) + NM_RECORDS_OFFSET, count * NM_RECORD_SIZE);
}

static void use_slot(nm_t *m, uint8_t slot)
{
    m->slot = slot;
    m->sequence = ns_sequence(&m->board->flash, m->self, &slots[slot]);
    m->stored.count = ns_count(&m->board->flash, m->self, &slots[slot]);
    m->stored.checksum = ns_checksum(&m->board->flash, m->self, &slots[slot]);
}

static bool erase_slot(const nm_t *m, uint8_t slot)
{
    return ns_erase(&m->board->flash, m->self, &slots[slot]);
}

static bool program(const nm_t *m, uint16_t at, const uint8_t *data, uint16_t length)
{
    return ns_program(&m->board->flash, m->self, &slots[unused_slot(m)], at, data, length);
}

/* Make the other slot, whose records are complete, the one in use. */
static bool seal_slot(nm_t *m, nm_list_t list)
{
    const uint8_t slot = unused_slot(m);
    if (!ns_seal(&m->board->flash, m->self, &slots[slot], list.count, m->sequence + 1))
        return false;
    use_slot(m, slot);
    return true;
}

/* True if this list is stored, and intact in flash. */
static bool is_stored(const nm_t *m, nm_list_t list)
{
    return same(list, m->stored) &&
           (m->slot == NM_SLOTS || checksum_in_slot(m, m->slot, list.count) == list.checksum);
}

/* ---- commands --------------------------------------------------------------------------------------------------------- */

/* NM_OK if the stored list and the configuration may be changed now. */
static nm_status_t may_write(const nm_t *m)
{
    if (m->board->armed(m->self))
        return NM_ARMED;
    return m->board->write_pending(m->self) ? NM_BUSY : NM_OK;
}

bool nm_spend_write(nm_t *m)
{
    if (m->writes_left == 0)
        return false;
    m->writes_left--;
    return true;
}

/* Prepare the unused slot for records. */
static nm_status_t clear_slot(nm_t *m)
{
    const uint8_t slot = unused_slot(m);
    if (ns_blank(slot_flash(m, slot), NM_SLOT_SIZE))
        return NM_OK;
    if (!nm_spend_write(m))
        return NM_BUSY;
    return erase_slot(m, slot) ? NM_OK : NM_FLASH;
}

static nm_list_t get_list(const uint8_t *body)
{
    nm_list_t list;
    list.count = ns_get16(body);
    list.checksum = ns_get32(body + 2);
    return list;
}

static void heard(nm_t *m)
{
    m->heard_ms = m->board->millis(m->self);
}

static nm_status_t begin(nm_t *m, const uint8_t *body)
{
    const nm_list_t list = get_list(body);
    nm_status_t status = may_write(m);
    if (list.count == 0 && list.checksum != 0)
        return NM_BAD_REQUEST;
    if (status != NM_OK)
        return status;
    if (!m->open || !same(list, m->wanted)) {
        m->open = false;
        if (list.count > NM_CAPACITY)
            return NM_NO_SPACE;
        if (is_stored(m, list))
            return NM_SAME;
        status = clear_slot(m);
        if (status != NM_OK)
            return status;
        m->open = true;
        m->wanted = list;
        m->staged.count = 0;
        m->staged.checksum = 0;
    }
    heard(m);
    return NM_OK;
}

static nm_status_t chunk(nm_t *m, const uint8_t *body, uint8_t length)
{
    const uint16_t first = ns_get16(body);
    const uint8_t *records = body + 2;
    const uint16_t bytes = (uint16_t)(length - 2u);
    const uint16_t count = (uint16_t)(bytes / NM_RECORD_SIZE);
    const uint16_t at = (uint16_t)(NM_RECORDS_OFFSET + m->staged.count * NM_RECORD_SIZE);
    const nm_status_t allowed = may_write(m);
    if (allowed != NM_OK)
        return allowed;
    if (!m->open)
        return NM_NO_TRANSFER;
    heard(m);
    if (first != m->staged.count)
        return first < m->staged.count ? NM_OK : NM_SEQUENCE;
    if (count > m->wanted.count - m->staged.count)
        return NM_RANGE;
    for (uint16_t i = 0; i < count; i++) {
        if (records[i * NM_RECORD_SIZE + COMMAND_AT] > LAST_COMMAND) {
            m->open = false;
            return NM_BAD_RECORD;
        }
    }
    if (!program(m, at, records, bytes)) {
        m->open = false;
        return NM_FLASH;
    }
    m->staged.count = (uint16_t)(m->staged.count + count);
    m->staged.checksum = nm_crc32(m->staged.checksum, slot_flash(m, unused_slot(m)) + at, bytes);
    return NM_OK;
}

static nm_status_t commit(nm_t *m, const uint8_t *body)
{
    const nm_list_t list = get_list(body);
    const nm_status_t allowed = may_write(m);
    if (allowed != NM_OK)
        return allowed;
    if (!m->open)
        return is_stored(m, list) ? NM_OK : NM_NO_TRANSFER;
    heard(m);
    if (m->staged.count < m->wanted.count)
        return NM_INCOMPLETE;
    m->open = false;
    if (!same(list, m->wanted) || checksum_in_slot(m, unused_slot(m), list.count) != list.checksum)
        return NM_CHECKSUM;
    if (!seal_slot(m, list))
        return NM_FLASH;
    m->board->list_changed(m->self, nm_records(m), m->stored.count);
    return NM_OK;
}

static nm_status_t set_radius(nm_t *m, const uint8_t *body)
{
    const uint16_t radius = ns_get16(body);
    const nm_status_t allowed = may_write(m);
    if ((radius ^ ns_get16(body + 2)) != 0xFFFF)
        return NM_BAD_REQUEST;
    if (allowed != NM_ARMED && radius == m->board->radius(m->self))
        return NM_OK;
    if (allowed != NM_OK)
        return allowed;
    if (radius > NM_MAX_RADIUS_CM)
        return NM_RANGE;
    if (!nm_spend_write(m))
        return NM_BUSY;
    m->board->set_radius(m->self, radius);
    return NM_OK;
}

/* ---- replies ---------------------------------------------------------------------------------------------------------- */

static int reply_list(uint8_t *reply, nm_status_t status, nm_list_t list)
{
    reply[0] = (uint8_t)status;
    ns_put16(reply + 1, list.count);
    ns_put32(reply + 3, list.checksum);
    return LIST_SIZE;
}

static int reply_progress(const nm_t *m, uint8_t *reply, nm_status_t status)
{
    const nm_list_t nothing = {0, 0};
    return reply_list(reply, status, m->open ? m->staged : nothing);
}

/* The checksum is computed from flash, which takes 2 ms for a full list: while armed, the main loop must not wait for that. */
static int reply_stored(const nm_t *m, uint8_t *reply, nm_status_t status)
{
    nm_list_t list = m->stored;
    if (m->slot != NM_SLOTS && !m->board->armed(m->self))
        list.checksum = checksum_in_slot(m, m->slot, list.count);
    return reply_list(reply, status, list);
}

static int reply_info(const nm_t *m, uint8_t *reply)
{
    reply[0] = NM_OK;
    reply[1] = NM_VERSION;
    reply[2] = (uint8_t)((m->board->armed(m->self) ? 1u : 0u) | (m->board->write_pending(m->self) ? 2u : 0u) |
                         (m->open ? 4u : 0u) | (m->writes_left == 0 ? 8u : 0u));
    reply[3] = NM_CHUNK_RECORDS;
    reply[4] = NM_CHUNK_WINDOW;
    reply[5] = NM_READ_RECORDS;
    ns_put16(reply + 6, NM_CAPACITY);
    ns_put16(reply + 8, m->stored.count);
    ns_put32(reply + 10, m->stored.checksum);
    ns_put16(reply + 14, m->board->radius(m->self));
    ns_put16(reply + 16, NM_BYTE_TIMEOUT_MS);
    ns_put16(reply + 18, m->open ? m->staged.count : 0);
    ns_put32(reply + 20, m->sequence);
    return INFO_SIZE;
}

static int reply_read(const nm_t *m, uint8_t *reply, const uint8_t *body, uint8_t length)
{
    const bool well_formed = length == 4 && body[2] != 0 && body[3] == 0;
    const uint16_t first = well_formed ? ns_get16(body) : 0;
    uint16_t count = body[2];
    ns_put16(reply + 1, first);
    if (!well_formed || first >= m->stored.count) {
        reply[0] = well_formed ? NM_RANGE : NM_BAD_REQUEST;
        return READ_SIZE;
    }
    if (count > NM_READ_RECORDS)
        count = NM_READ_RECORDS;
    if (count > m->stored.count - first)
        count = (uint16_t)(m->stored.count - first);
    reply[0] = NM_OK;
    memcpy(reply + READ_SIZE, nm_records(m) + first * NM_RECORD_SIZE, count * NM_RECORD_SIZE);
    return (int)(READ_SIZE + count * NM_RECORD_SIZE);
}

static int reply_abort(nm_t *m, uint8_t *reply, uint8_t length)
{
    if (length == 0)
        m->open = false;
    reply[0] = length == 0 ? NM_OK : NM_BAD_REQUEST;
    return ABORT_SIZE;
}

static int reply_radius(const nm_t *m, uint8_t *reply, nm_status_t status)
{
    reply[0] = (uint8_t)status;
    ns_put16(reply + 1, m->board->radius(m->self));
    return RADIUS_SIZE;
}

/* ---- requests --------------------------------------------------------------------------------------------------------- */

uint8_t nm_unmask(uint8_t *payload, uint8_t size)
{
    if (size % 2 == 0)
        return 0;
    for (uint8_t i = 1; i < size; i++)
        payload[i] ^= payload[0];
    return (uint8_t)(size - 1);
}

static bool chunk_length(uint8_t length)
{
    return length > 2 && (length - 2u) % NM_RECORD_SIZE == 0 && (length - 2u) / NM_RECORD_SIZE <= NM_CHUNK_RECORDS;
}

int nm_handle(nm_t *m, uint8_t command, uint8_t *buffer, uint8_t size)
{
    const uint8_t *body = buffer + 1;
    uint8_t length;

    nm_poll(m);
    switch (command) {
    case NM_INFO:
        return reply_info(m, buffer);
    case NM_BEGIN:
        return reply_progress(m, buffer, nm_unmask(buffer, size) == 6 ? begin(m, body) : NM_BAD_REQUEST);
    case NM_CHUNK:
        length = nm_unmask(buffer, size);
        return reply_progress(m, buffer, chunk_length(length) ? chunk(m, body, length) : NM_BAD_REQUEST);
    case NM_COMMIT:
        return reply_stored(m, buffer, nm_unmask(buffer, size) == 6 ? commit(m, body) : NM_BAD_REQUEST);
    case NM_ABORT:
        return reply_abort(m, buffer, size);
    case NM_READ:
        return reply_read(m, buffer, body, nm_unmask(buffer, size));
    case NM_RADIUS:
        return reply_radius(m, buffer, nm_unmask(buffer, size) == 4 ? set_radius(m, body) : NM_BAD_REQUEST);
    default:
        return -1;
    }
}

/* ---- the firmware's side ---------------------------------------------------------------------------------------------- */

void nm_start(nm_t *m, const nm_board_t *board, void *self)
{
    memset(m, 0, sizeof *m);
    m->board = board;
    m->self = self;
    m->slot = NM_SLOTS;
    m->writes_left = NM_WRITE_BURST;
    m->credited_ms = board->millis(self);
    for (uint8_t slot = 0; slot < NM_SLOTS; slot++) {
        const uint32_t sequence = ns_sequence(&board->flash, self, &slots[slot]);
        if (ns_valid(&board->flash, self, &slots[slot]) && (m->slot == NM_SLOTS || sequence - m->sequence < 0x80000000u))
            use_slot(m, slot);
    }
}

void nm_poll(nm_t *m)
{
    const uint32_t now_ms = m->board->millis(m->self);
    if (m->open && (m->board->armed(m->self) || now_ms - m->heard_ms > NM_IDLE_TIMEOUT_MS))
        m->open = false;
    for (; now_ms - m->credited_ms >= NM_WRITE_INTERVAL_MS; m->credited_ms += NM_WRITE_INTERVAL_MS)
        if (m->writes_left < NM_WRITE_BURST)
            m->writes_left++;
}

nm_status_t nm_store(nm_t *m, const uint8_t *records, uint16_t count)
{
    const uint16_t bytes = (uint16_t)(count * NM_RECORD_SIZE);
    nm_list_t list;
    if (m->board->armed(m->self))
        return NM_ARMED;
    if (count > NM_CAPACITY)
        return NM_NO_SPACE;
    list.count = count;
    list.checksum = nm_crc32(0, records, bytes);
    if (is_stored(m, list))
        return NM_SAME;
    m->open = false;
    if (!erase_slot(m, unused_slot(m)) || !program(m, NM_RECORDS_OFFSET, records, bytes) || !seal_slot(m, list))
        return NM_FLASH;
    return NM_OK;
}

const uint8_t *nm_records(const nm_t *m)
{
    return m->slot == NM_SLOTS ? NULL : slot_flash(m, m->slot) + NM_RECORDS_OFFSET;
}
