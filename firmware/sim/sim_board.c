/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sim_board.h"

#include <stdlib.h>
#include <string.h>

enum { POWER_CUT = -2 };

static uint8_t config_byte(uint16_t i)
{
    return (uint8_t)(i * 7u + 1u);
}

/* ---- flash ------------------------------------------------------------------------------------------------------------ */

static uint8_t random_bits(sim_t *s)
{
    s->random = s->random * 1664525u + 1013904223u;
    return (uint8_t)(s->random >> 24);
}

static bool cut_now(sim_t *s, sim_cut_t cut)
{
    return s->operations == s->cut_at && s->cut == cut;
}

static void lose_power(sim_t *s)
{
    s->powered = false;
    longjmp(s->lost, 1);
}

static bool fails(const sim_t *s, sim_fail_t fail)
{
    return s->operations == s->fail_at && s->fail == fail;
}

static bool erase(void *self, uint8_t page)
{
    sim_t *s = self;
    if (page >= NM_PAGES) {
        s->violations++;
        return false;
    }
    s->operations++;
    if (cut_now(s, SIM_CUT_BEFORE))
        lose_power(s);
    if (fails(s, SIM_FAIL_LOUD))
        return false;
    s->erases[page]++;
    uint8_t *bytes = s->flash + page * NM_PAGE_SIZE;
    if (cut_now(s, SIM_CUT_WITHIN)) {
        for (uint16_t i = 0; i < NM_PAGE_SIZE; i++)
            bytes[i] |= random_bits(s);
        lose_power(s);
    }
    memset(bytes, 0xFF, NM_PAGE_SIZE);
    if (fails(s, SIM_FAIL_SILENT))
        bytes[random_bits(s)] = 0xFE;
    if (cut_now(s, SIM_CUT_AFTER))
        lose_power(s);
    return true;
}

static bool program_half_word(sim_t *s, uint8_t *at, const uint8_t *data)
{
    const bool erased = at[0] == 0xFF && at[1] == 0xFF;
    const bool zeros = data[0] == 0 && data[1] == 0;
    s->operations++;
    if (cut_now(s, SIM_CUT_BEFORE))
        lose_power(s);
    if (!erased && !zeros) {
        s->violations++;
        return false;
    }
    if (fails(s, SIM_FAIL_LOUD))
        return false;
    if (cut_now(s, SIM_CUT_WITHIN)) {
        at[0] &= (uint8_t)(data[0] | random_bits(s));
        at[1] &= (uint8_t)(data[1] | random_bits(s));
        if (at[0] == 0xFF && at[1] == 0xFF) /* none of the bits moved: that would be SIM_CUT_BEFORE */
            memcpy(at, data, 2);
        lose_power(s);
    }
    memcpy(at, data, 2);
    if (fails(s, SIM_FAIL_SILENT))
        at[0] ^= 0x10;
    if (cut_now(s, SIM_CUT_AFTER))
        lose_power(s);
    return true;
}

static bool program(void *self, uint16_t offset, const uint8_t *data, uint16_t length)
{
    sim_t *s = self;
    if (offset % 2 || length % 2 || offset > NM_FLASH_SIZE || length > NM_FLASH_SIZE - offset) {
        s->violations++;
        return false;
    }
    for (uint16_t i = 0; i < length; i = (uint16_t)(i + 2))
        if (!program_half_word(s, s->flash + offset + i, data + i))
            return false;
    return true;
}

static const uint8_t *flash(void *self)
{
    return ((const sim_t *)self)->flash;
}

/* ---- the rest of the board -------------------------------------------------------------------------------------------- */

static uint32_t now_ms(void *self)
{
    return ((const sim_t *)self)->now_ms;
}

static bool armed(void *self)
{
    return ((const sim_t *)self)->armed;
}

static bool write_pending(void *self)
{
    const sim_t *s = self;
    return s->write_pending || s->radius_cm != s->saved_radius_cm;
}

static uint16_t radius(void *self)
{
    return ((const sim_t *)self)->radius_cm;
}

static void set_radius(void *self, uint16_t radius_cm)
{
    sim_t *s = self;
    s->radius_cm = radius_cm;
}

static void list_changed(void *self, const uint8_t *records, uint16_t count)
{
    sim_t *s = self;
    memcpy(s->list, records, count * NM_RECORD_SIZE);
    s->list_count = count;
    s->changes++;
}

static const nm_board_t board = {{erase, program, flash}, now_ms, armed, write_pending, radius, set_radius, list_changed};

void sim_init(sim_t *s)
{
    memset(s, 0, sizeof *s);
    memset(s->flash, 0xFF, NM_FLASH_SIZE);
    for (uint16_t i = 0; i < NM_PAGE_SIZE; i++)
        s->flash[SIM_CONFIG_OFFSET + i] = config_byte(i);
    s->saved_radius_cm = 200;
    s->random = 1;
    sim_power_up(s);
}

sim_t *sim_create(void)
{
    sim_t *s = malloc(sizeof *s);
    if (s)
        sim_init(s);
    return s;
}

void sim_destroy(sim_t *s)
{
    free(s);
}

void sim_power_up(sim_t *s)
{
    s->armed = s->write_pending = false;
    s->radius_cm = s->saved_radius_cm;
    s->now_ms = 0;
    s->frame_length = 0;
    s->list_count = 0;
    sim_cut_at(s, 0, SIM_CUT_BEFORE);
    sim_fail_at(s, 0, SIM_FAIL_LOUD);
    s->powered = true;
    nm_start(&s->core, &board, s);
    if (nm_records(&s->core))
        list_changed(s, nm_records(&s->core), s->core.stored.count);
}

void sim_cut_at(sim_t *s, uint32_t cut_at, sim_cut_t cut)
{
    s->operations = 0;
    s->cut_at = cut_at;
    s->cut = cut;
}

void sim_fail_at(sim_t *s, uint32_t fail_at, sim_fail_t fail)
{
    s->operations = 0;
    s->fail_at = fail_at;
    s->fail = fail;
}

int sim_request(sim_t *s, uint8_t command, uint8_t *buffer, uint8_t size)
{
    if (!s->powered || setjmp(s->lost))
        return POWER_CUT;
    return nm_handle(&s->core, command, buffer, size);
}

int sim_store(sim_t *s, const uint8_t *records, uint16_t count)
{
    if (!s->powered || setjmp(s->lost))
        return POWER_CUT;
    return (int)nm_store(&s->core, records, count);
}

void sim_advance(sim_t *s, uint32_t milliseconds)
{
    while (milliseconds) {
        const uint32_t step = milliseconds < 1000 ? milliseconds : 1000;
        s->now_ms += step;
        milliseconds -= step;
        nm_poll(&s->core);
        if (!s->armed)
            s->saved_radius_cm = s->radius_cm;
    }
}

void sim_arm(sim_t *s, bool is_armed)
{
    s->armed = is_armed;
    nm_poll(&s->core);
}

/* ---- frames ----------------------------------------------------------------------------------------------------------- */

static uint8_t xor_bytes(const uint8_t *bytes, uint16_t length)
{
    uint8_t sum = 0;
    while (length--)
        sum ^= *bytes++;
    return sum;
}

static int reply_frame(sim_t *s, uint8_t *reply)
{
    uint8_t *payload = reply + 5;
    int size;
    memcpy(payload, s->frame + 5, s->frame[3]);
    size = sim_request(s, s->frame[4], payload, s->frame[3]);
    if (size == POWER_CUT)
        return POWER_CUT;
    memcpy(reply, size < 0 ? "$M!" : "$M>", 3);
    if (size < 0)
        size = 0;
    reply[3] = (uint8_t)size;
    reply[4] = s->frame[4];
    payload[size] = xor_bytes(reply + 3, (uint16_t)(size + 2));
    return size + 6;
}

int sim_receive(sim_t *s, uint8_t byte, uint8_t *reply)
{
    static const uint8_t start[3] = {'$', 'M', '<'};
    if (s->frame_length && s->now_ms - s->frame_ms >= NM_BYTE_TIMEOUT_MS)
        s->frame_length = 0;
    s->frame_ms = s->now_ms;
    s->frame[s->frame_length++] = byte;
    if (s->frame_length <= 3 && byte != start[s->frame_length - 1])
        s->frame_length = 0;
    else if (s->frame_length == 4 && byte > NM_BUFFER_SIZE)
        s->frame_length = 0;
    else if (s->frame_length > 5 && s->frame_length == s->frame[3] + 6) {
        s->frame_length = 0;
        if (xor_bytes(s->frame + 3, (uint16_t)(s->frame[3] + 3)) == 0)
            return reply_frame(s, reply);
    }
    return 0;
}

bool sim_config_intact(const sim_t *s)
{
    for (uint16_t i = 0; i < NM_PAGE_SIZE; i++)
        if (s->flash[SIM_CONFIG_OFFSET + i] != config_byte(i))
            return false;
    return true;
}

void sim_set_write_pending(sim_t *s, bool pending)
{
    s->write_pending = pending;
}

uint32_t sim_operations(const sim_t *s)
{
    return s->operations;
}

uint32_t sim_violations(const sim_t *s)
{
    return s->violations;
}

uint32_t sim_changes(const sim_t *s)
{
    return s->changes;
}

uint16_t sim_list(const sim_t *s, uint8_t *records)
{
    memcpy(records, s->list, s->list_count * NM_RECORD_SIZE);
    return s->list_count;
}

uint8_t *sim_flash(sim_t *s)
{
    return s->flash;
}

uint32_t sim_flash_size(void)
{
    return SIM_FLASH_SIZE;
}
