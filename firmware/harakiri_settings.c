/* SPDX-License-Identifier: GPL-3.0-or-later */
/* See harakiri_settings.h, which is the manual, and docs/msp-mission.md, which is the specification. */
#include "harakiri_settings.h"

#include "board.h"
#include "harakiri_config.h"
#include "harakiri_guard.h"
#include "harakiri_mission.h"
#include "mw.h"

enum { SETTING = 197, SET_SETTING = 198 };

enum { SETTING_BODY = 4, SET_SETTING_BODY = 10 };

/* In a reply: the status and the request's index, then entries, or the number of settings and the checksum of all. */
enum { HEADER_SIZE = 3, TABLE_SIZE = HEADER_SIZE + 2 + 4 };

/* In an entry; the name has no terminator. Its description, which is everything but the value, identifies the setting. */
enum { VALUE_AT = 0, TYPE_AT = 4, MIN_AT = 5, MAX_AT = 9, LENGTH_AT = 13, NAME_AT = 14, NAME_MAX_SIZE = 32 };

#define WHOLE_TABLE 0xFFFFu
#define REPLY_MAX_SIZE 218u /* with its frame 224 bytes, the most that the page allows to be outstanding */

typedef char entry_fits_a_reply[HEADER_SIZE + NAME_AT + NAME_MAX_SIZE <= REPLY_MAX_SIZE ? 1 : -1];

/* The types come in pairs of 1, 2 and 4 bytes. */
static unsigned size_of(const setting_t *setting)
{
    return 1u << (setting->type >> 1);
}

static uint32_t held(const setting_t *setting)
{
    uint32_t value = 0;
    memcpy(&value, setting->variable, size_of(setting));
    if (setting->type == SETTING_INT8)
        return (uint32_t)(int8_t)value;
    if (setting->type == SETTING_INT16)
        return (uint32_t)(int16_t)value;
    return value;
}

static unsigned entry_size(const setting_t *setting)
{
    const size_t length = strlen(setting->name);
    return NAME_AT + (length < NAME_MAX_SIZE ? (unsigned)length : NAME_MAX_SIZE);
}

static unsigned put_entry(uint8_t *to, const setting_t *setting)
{
    const unsigned size = entry_size(setting);
    const uint32_t value = held(setting);
    memcpy(to + VALUE_AT, &value, 4);
    to[TYPE_AT] = setting->type;
    memcpy(to + MIN_AT, &setting->min, 4);
    memcpy(to + MAX_AT, &setting->max, 4);
    to[LENGTH_AT] = (uint8_t)(size - NAME_AT);
    memcpy(to + NAME_AT, setting->name, size - NAME_AT);
    return size;
}

static uint32_t checksum_of_all(uint16_t *count)
{
    uint8_t entry[NAME_AT + NAME_MAX_SIZE];
    uint32_t checksum = 0;
    setting_t setting;
    for (*count = 0; SettingEntry(*count, &setting); (*count)++)
        checksum = nm_crc32(checksum, entry, put_entry(entry, &setting));
    return checksum;
}

/*
 * True for settings that crash a running Harakiri: with a part of a new orientation alignSensors() writes outside of its array,
 * and gbl_flg forwards channels to servo outputs that were not set up at the start.
 */
static bool is_fixed(const setting_t *setting)
{
    const uintptr_t at = (uintptr_t)setting->variable, table = (uintptr_t)cfg.align;
    return (at >= table && at < table + sizeof cfg.align) || setting->variable == &cfg.gbl_flg;
}

static bool may_hold(const setting_t *setting, uint32_t value)
{
    if (setting->type == SETTING_FLOAT) {
        float number;
        memcpy(&number, &value, 4);
        return number >= (float)setting->min && number <= (float)setting->max; /* false for NaN */
    }
    /* While disarmed the mixer sends esc_moff to the motors at once: it must not start them. */
    if (setting->variable == &cfg.esc_moff && value > cfg.esc_moff)
        return false;
    if (is_fixed(setting) && value != held(setting))
        return false;
    return (int32_t)value >= setting->min && (int32_t)value <= setting->max;
}

/* Another sensor or gain invalidates the calibration, as in the CLI (cliSet). */
static void invalidate_calibration(const setting_t *setting)
{
    if (setting->variable == &cfg.acc_hdw) {
        cfg.angleTrim[0] = cfg.angleTrim[1] = 0.0f;
        cfg.accZero[0] = cfg.accZero[1] = cfg.accZero[2] = 0.0f;
        cfg.sens_1G = 1;
        cfg.acc_calibrated = 0;
    }
    if (setting->variable == &cfg.mag_gain)
        cfg.mag_calibrated = 0;
}

/* The status of a request to change or save settings, as far as it does not depend on the setting. */
static nm_status_t may_write(void)
{
    if (MotorsMayRun())
        return NM_ARMED;
    return ScheduleEEPROMwriteMS ? NM_BUSY : NM_OK;
}

static unsigned reply_status(uint8_t *reply, nm_status_t status, uint16_t index)
{
    reply[0] = (uint8_t)status;
    memcpy(reply + 1, &index, 2);
    return HEADER_SIZE;
}

static unsigned reply_table(uint8_t *reply, nm_status_t status)
{
    uint16_t count;
    const uint32_t checksum = checksum_of_all(&count);
    (void)reply_status(reply, status, WHOLE_TABLE);
    memcpy(reply + HEADER_SIZE, &count, 2);
    memcpy(reply + HEADER_SIZE + 2, &checksum, 4);
    return TABLE_SIZE;
}

static unsigned read_settings(uint8_t *buffer, uint8_t length)
{
    uint16_t first = 0, wanted = 0;
    unsigned size;
    setting_t setting;
    if (length == SETTING_BODY) {
        memcpy(&first, buffer + 1, 2);
        memcpy(&wanted, buffer + 3, 2);
    }
    if (wanted == 0)
        return reply_status(buffer, NM_BAD_REQUEST, 0);
    if (MotorsMayRun())
        return reply_status(buffer, NM_ARMED, first);
    if (first == WHOLE_TABLE)
        return reply_table(buffer, NM_OK);
    size = reply_status(buffer, SettingEntry(first, &setting) ? NM_OK : NM_RANGE, first);
    while (wanted-- && SettingEntry(first++, &setting) && size + entry_size(&setting) <= REPLY_MAX_SIZE)
        size += put_entry(buffer + size, &setting);
    return size;
}

static unsigned save_all(uint8_t *buffer, uint32_t expected)
{
    uint16_t count;
    nm_status_t status = NM_OK;
    if (checksum_of_all(&count) != expected)
        status = NM_CHECKSUM;
    else if (!ConfigSpendWrite())
        status = NM_BUSY;
    else
        ScheduleEEPROMwriteMS = 1; /* in this loop, so that arming and missions do not wait for it */
    return reply_table(buffer, status);
}

static unsigned set_setting(uint8_t *buffer, uint8_t length)
{
    uint16_t index;
    uint32_t identity, value;
    nm_status_t status = may_write();
    unsigned size;
    setting_t setting;
    if (length != SET_SETTING_BODY)
        return reply_status(buffer, NM_BAD_REQUEST, 0);
    memcpy(&index, buffer + 1, 2);
    memcpy(&identity, buffer + 3, 4);
    memcpy(&value, buffer + 7, 4);
    if (status != NM_OK)
        return reply_status(buffer, status, index);
    if (index == WHOLE_TABLE)
        return identity ? reply_status(buffer, NM_BAD_REQUEST, index) : save_all(buffer, value);
    if (!SettingEntry(index, &setting))
        return reply_status(buffer, NM_RANGE, index);
    size = put_entry(buffer + HEADER_SIZE, &setting);
    if (nm_crc32(0, buffer + HEADER_SIZE + TYPE_AT, size - TYPE_AT) != identity)
        return reply_status(buffer, NM_CHECKSUM, index);
    if (!may_hold(&setting, value))
        status = NM_RANGE;
    else if (value != held(&setting)) {
        memcpy(setting.variable, &value, size_of(&setting));
        invalidate_calibration(&setting);
    }
    return reply_status(buffer, status, index) + put_entry(buffer + HEADER_SIZE, &setting);
}

int SettingsRequest(uint8_t command, uint8_t *buffer, uint8_t size)
{
    if (command == SETTING)
        return (int)read_settings(buffer, nm_unmask(buffer, size));
    if (command == SET_SETTING)
        return (int)set_setting(buffer, nm_unmask(buffer, size));
    return -1;
}
