/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Replaces Harakiri's headers when harakiri_flight.c is tested on the host: only the names that it uses. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef union {
    uint8_t bytes[16];
} wp_t;

typedef struct {
    uint8_t gps_type, mission_fly;
    uint16_t mission_radius;
    float gps_ins_vel, bar_dscl;
    uint16_t gps_wp_radius, rc_mid, rc_minchk, rc_maxchk;
    uint8_t nav_speed_min, mission_battery; /* in the gaps of Harakiri's own struct */
    uint16_t nav_speed_max;
    uint8_t as_clmbr, al_barolr, fs_jstph, gps_maxangle, rtl_mnh, rc_dbah, rc_dbgps, mag_calibrated, vbatmincellvoltage;
    uint32_t aligned;
    uint8_t one, nav_tiltcomp, mission_fix, mission_first;
    float nav_ctrkgain;
    uint8_t another, rtl_cr, mission_climb, mission_height;
    uint32_t serial_baudrate;
} config_t;

typedef struct {
    uint8_t ARMED, GPS_AUTO_MODE, GPS_HOLD_MODE, GPS_FIX_HOME;
} flags_t;

enum { ROLL, PITCH, YAW, THROTTLE };
enum { LAT, LON };
enum { BOXANGLE, BOXHORIZON, BOXBARO, BOXMAG, BOXGPSHOME, BOXGPSHOLD, BOXGPSAUTO, BOXPASSTHRU, BOXHEADFREE, CHECKBOXITEMS };
enum { NAV_MODE_NONE, NAV_MODE_POSHOLD, NAV_MODE_RTL, NAV_MODE_WP };
enum { FEATURE_VBAT = 1 };
enum { SENSOR_BARO = 1, SENSOR_MAG = 2, SENSOR_GPS = 4 };

#define RADX 0.0174532925f
#define constrain(value, low, high) ((value) < (low) ? (low) : (value) > (high) ? (high) : (value))

extern config_t cfg;
extern flags_t f;
extern int16_t rcData[8], rcCommand[4];
extern uint8_t rcOptions[CHECKBOXITEMS], vbat;
extern int32_t Real_GPS_coord[2], GPS_home[2];
extern volatile uint8_t GPS_numSat;
extern volatile bool GPS_FIX;
extern bool GroundAltInitialized;
extern float EstAlt, vario, heading, magHold, angle[2], cos_yaw_x, sin_yaw_y;
extern int8_t nav_mode;
extern uint16_t GPS_speed, GPS_ground_course;
extern uint8_t GPS_update;
extern uint32_t currentTimeMS;

bool feature(uint32_t mask);
bool sensors(uint32_t mask);
bool FloppyReadWP(uint16_t *number, wp_t *record);
float wrap_180(float angle);

#endif
