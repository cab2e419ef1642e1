/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "harakiri_guard.h"

#include "board.h"
#include "harakiri_config.h"
#include "mw.h"

/* The commands that change something, and MSP_WP; numbers and sizes as in evaluateCommand() (serial.c). */
enum {
    WP = 118,
    SET_RAW_RC = 200,
    SET_RAW_GPS = 201,
    SET_PID = 202,
    SET_BOX = 203,
    SET_RC_TUNING = 204,
    ACC_CALIBRATION = 205,
    MAG_CALIBRATION = 206,
    SET_MISC = 207,
    RESET_CONF = 208,
    EEPROM_WRITE = 250,
    DEBUG = 254
};

bool MotorsMayRun(void)
{
    return f.ARMED || (feature(FEATURE_PASS) && rcData[THROTTLE] >= cfg.rc_minchk);
}

bool GuardAccepts(uint8_t command, uint8_t size)
{
    if (command >= SET_RAW_RC && command != DEBUG && MotorsMayRun())
        return false;
    switch (command) {
    case WP: /* else it would answer for the number left in the buffer */
        return size == 1;
    case SET_RAW_RC:
        return size == 8 * 2;
    case SET_RAW_GPS:
        return size == 14;
    case SET_PID:
        return size == 3 * PIDITEMS;
    case SET_BOX: /* one more byte pair for each switch if there are more than four of them */
        return size == (cfg.rc_auxch > 4 ? 4 : 2) * CHECKBOXITEMS;
    case SET_RC_TUNING:
        return size == 7;
    case SET_MISC: /* its handler ignores the payload, whose size differs between configuration programs */
        return size != 0;
    case ACC_CALIBRATION:
    case MAG_CALIBRATION:
    case RESET_CONF:
    case EEPROM_WRITE:
        return size == 0 && ConfigSpendWrite();
    default:
        return true;
    }
}
