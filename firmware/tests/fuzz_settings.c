/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Requests of a fuzzer to harakiri_settings.c. An input is a sequence of requests, each: flags (1 armed, 2 write scheduled,
 * 4 SET_SETTING, 8 with the correct identity of the setting), a size, and the payload; the rest of the buffer keeps stale bytes.
 *
 * Always: a reply fits the buffer, every setting stays in its range, and a request that is not accepted changes nothing.
 */
#include "harakiri_settings.c"
#include "harakiri/settings_table.h"

#include <stdlib.h>

config_t cfg;
uint32_t ScheduleEEPROMwriteMS;
static bool armed;
static unsigned writes_left;

static void expect(bool condition)
{
    if (!condition)
        abort();
}

bool MotorsMayRun(void)
{
    return armed;
}

bool ConfigSpendWrite(void)
{
    return writes_left && writes_left--;
}

static void expect_ranges(void)
{
    for (unsigned i = 0; i < SETTINGS; i++) {
        const setting_t *s = &settings_table[i];
        const uint32_t value = held(s);
        expect(s->variable == &cfg.esc_moff ? value <= 1000 : may_hold(s, value));
    }
}

static uint8_t buffer[NM_BUFFER_SIZE];

static void put_identity(void)
{
    uint8_t entry[NAME_AT + NAME_MAX_SIZE];
    const setting_t *s = &settings_table[buffer[1] % SETTINGS];
    const uint32_t identity = nm_crc32(0, entry + TYPE_AT, put_entry(entry, s) - TYPE_AT);
    buffer[0] = buffer[2] = 0;
    buffer[1] %= SETTINGS;
    memcpy(buffer + 3, &identity, 4);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    memset(&cfg, 0, sizeof cfg);
    cfg.serial_baudrate = 115200;
    cfg.esc_moff = 1000;
    cfg.rc_auxch = 4;
    writes_left = 2;
    while (size >= 2) {
        const uint8_t flags = data[0], length = data[1] % (NM_BUFFER_SIZE + 1);
        const size_t taken = size - 2 < length ? size - 2 : length;
        const config_t before = cfg;
        memcpy(buffer, data + 2, taken);
        data += 2 + taken;
        size -= 2 + taken;
        armed = flags & 1;
        ScheduleEEPROMwriteMS = flags & 2 ? 5 : 0;
        if (flags & 8)
            put_identity();
        const int reply = SettingsRequest(flags & 4 ? SET_SETTING : SETTING, buffer, length);
        expect(reply >= HEADER_SIZE && reply <= (int)REPLY_MAX_SIZE && buffer[0] <= NM_BAD_RECORD);
        if (armed || (flags & 2) || !(flags & 4) || buffer[0] != NM_OK)
            expect(memcmp(&before, &cfg, sizeof cfg) == 0 && ScheduleEEPROMwriteMS == (flags & 2 ? 5u : 0u));
        expect_ranges();
    }
    return 0;
}
