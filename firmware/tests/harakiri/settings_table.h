/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A valueTable with each type and each setting that harakiri_settings.c treats specially. */
#include "board.h"
#include "harakiri_settings.h"

static const setting_t settings_table[] = {
    {"rc_db", &cfg.rc_db, 0, 32, SETTING_UINT8},
    {"gbl_pgn", &cfg.gbl_pgn, -100, 100, SETTING_INT8},
    {"gps_wp_radius", &cfg.gps_wp_radius, 0, 2000, SETTING_UINT16},
    {"mag_dec", &cfg.mag_dec, -18000, 18000, SETTING_INT16},
    {"serial_baudrate", &cfg.serial_baudrate, 1200, 0x7FFFFFFF, SETTING_UINT32},
    {"bar_lag", &cfg.bar_lag, 0, 10, SETTING_FLOAT},
    {"esc_moff", &cfg.esc_moff, 0, 2000, SETTING_UINT16},
    {"acc_hdw", &cfg.acc_hdw, 0, 3, SETTING_UINT8},
    {"mag_gain", &cfg.mag_gain, 0, 1, SETTING_UINT8},
    {"align_acc_z", &cfg.align[1][2], -3, 3, SETTING_INT8},
    {"gbl_flg", &cfg.gbl_flg, 0, 255, SETTING_UINT8},
    {"a_name_that_is_longer_than_an_entry_can_hold", &cfg.rc_auxch, 4, 6, SETTING_UINT8},
};

enum { SETTINGS = sizeof settings_table / sizeof *settings_table };

bool SettingEntry(uint16_t index, setting_t *setting)
{
    if (index >= SETTINGS)
        return false;
    *setting = settings_table[index];
    return true;
}
