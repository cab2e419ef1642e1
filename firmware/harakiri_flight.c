/* SPDX-License-Identifier: GPL-3.0-or-later */
/* See harakiri_flight.h. */
#include "harakiri_flight.h"

#include <stddef.h>
#include <string.h>

#include "board.h"
#include "harakiri_mission.h"
#include "mw.h"

/* The settings are in gaps of config_t, so that a build without them reads the same configuration. */
typedef char settings_fill_gaps[offsetof(config_t, gps_ins_vel) == offsetof(config_t, gps_type) + 4 &&
                                        offsetof(config_t, serial_baudrate) == offsetof(config_t, rtl_cr) + 3 &&
                                        offsetof(config_t, nav_ctrkgain) == offsetof(config_t, nav_tiltcomp) + 3
                                    ? 1
                                    : -1];

enum { FLIGHT = 179, REPLY_SIZE = 24, SETTLED_CM_S = 50 };

extern uint16_t batteryWarningVoltage;

static nf_t flight;
static nf_output_t out;
static bool failsafe, launched, grounded, nosed, own_gains;
static uint16_t announced = NF_NO_RECORD;

static bool read_record(void *self, uint16_t number, uint8_t *record)
{
    wp_t dataset;
    (void)self;
    if (!FloppyReadWP(&number, &dataset))
        return false;
    memcpy(record, dataset.bytes, NM_RECORD_SIZE);
    return true;
}

static void set_default(uint8_t *setting, uint8_t low, uint8_t high, uint8_t value)
{
    if (*setting < low || *setting > high)
        *setting = value;
}

void FlightDefaults(void)
{
    set_default(&cfg.mission_fly, 0, 1, 0);
    set_default(&cfg.mission_first, 10, 250, 200);
    set_default(&cfg.mission_height, 5, 250, 100);
    set_default(&cfg.mission_climb, 20, 250, 100);
    set_default(&cfg.mission_nav_p, 5, 200, 70);
    set_default(&cfg.mission_nav_i, 1, 200, 60);
}

void FlightFailsafe(void)
{
    failsafe = true;
}

static bool battery_low(void)
{
    return feature(FEATURE_VBAT) && vbat <= batteryWarningVoltage && vbat >= cfg.vbatmincellvoltage;
}

static void get_settings(nf_settings_t *settings)
{
    settings->enabled = cfg.mission_fly == 1;
    settings->radius_cm = cfg.gps_wp_radius;
    settings->first_m = cfg.mission_first;
    settings->height_m = cfg.mission_height;
    settings->climb_cm_s = cfg.mission_climb;
    settings->launch_cm_s = cfg.as_clmbr;
    settings->landing_cm_s = cfg.al_barolr;
    settings->speed_cm_s = cfg.nav_speed_max;
}

static void get_input(nf_input_t *in, bool rtl, bool flying)
{
    memset(in, 0, sizeof *in);
    in->now_ms = currentTimeMS;
    in->place.lat = Real_GPS_coord[LAT];
    in->place.lon = Real_GPS_coord[LON];
    in->home.lat = GPS_home[LAT];
    in->home.lon = GPS_home[LON];
    in->height_cm = (int32_t)EstAlt;
    in->climb_cm_s = (int32_t)vario;
    in->heading_cd = (int32_t)(heading * 100.0f);
    in->list = MissionStored();
    in->switch_on = rcOptions[BOXGPSAUTO] != 0;
    in->armed = f.ARMED != 0;
    in->flying = flying;
    in->fix = sensors(SENSOR_GPS) && GPS_FIX && GPS_numSat >= 5;
    in->home_known = f.GPS_FIX_HOME != 0;
    in->instruments = sensors(SENSOR_MAG) && cfg.mag_calibrated && sensors(SENSOR_BARO) && GroundAltInitialized;
    in->failsafe = failsafe;
    in->rtl = rtl;
    in->stick = abs(rcCommand[ROLL]) > cfg.rc_dbgps || abs(rcCommand[PITCH]) > cfg.rc_dbgps;
    in->yaw_stick = abs(rcCommand[YAW]) >= 70; /* from there on Harakiri turns instead of holding the heading */
    in->throttle_middle = abs(rcData[THROTTLE] - cfg.rc_mid) <= cfg.rc_dbah;
    in->arrived = f.GPS_AUTO_MODE && nav_mode == NAV_MODE_POSHOLD;
    in->settled = in->arrived && GPS_speed < SETTLED_CM_S;
    in->battery_low = battery_low();
}

/*
 * Fly to the target. GPS_AUTO_MODE must be set before nav_mode, or this loop's navigation drops it. A target that follows a
 * fast corner keeps the speed, which GPS_set_next_wp() would restart from the lowest.
 */
static void go(void)
{
    if (out.issue || !f.GPS_AUTO_MODE || nav_mode == NAV_MODE_NONE) {
        const float speed = waypoint_speed_gov;
        const bool fast = WP_Fastcorner && f.GPS_AUTO_MODE && nav_mode == NAV_MODE_WP;
        f.GPS_AUTO_MODE = 1;
        nav_mode = NAV_MODE_WP;
        wp_status = WP_STATUS_NAVIGATING;
        GPS_set_next_wp(&out.target.lat, &out.target.lon);
        if (fast)
            waypoint_speed_gov = speed;
        GPS_set_nav_gains(cfg.mission_nav_p, cfg.mission_nav_i);
        own_gains = true;
    }
    WP_Fastcorner = !out.brake; /* which GPS_reset_nav() clears */
}

/* The throttle stick for a climb rate, as GetClimbrateTorcDataTHROTTLE() in mw.c makes it; altitude hold scales a descent. */
static void climb(int16_t rate_cm_s)
{
    int stick = cfg.rc_mid;
    if (rate_cm_s > 0)
        stick += (int)(rate_cm_s * 0.8f) + cfg.rc_dbah;
    else if (rate_cm_s < 0 && cfg.bar_dscl > 0.1f)
        stick += (int)(rate_cm_s * 0.8f / cfg.bar_dscl) - cfg.rc_dbah;
    rcData[THROTTLE] = (int16_t)constrain(stick, cfg.rc_minchk + 1, cfg.rc_maxchk);
}

/* A return home that has ended the flight keeps its gains: with the firmware's own it may not arrive against the wind. */
static void leave(bool returns)
{
    f.GPS_AUTO_MODE = 0; /* which a lost fix has cleared before */
    if (own_gains && !returns) {
        GPS_set_pids();
        own_gains = false;
    }
}

static void act(void)
{
    rcOptions[BOXBARO] = 1;
    rcOptions[BOXMAG] = 1;
    rcOptions[BOXANGLE] = 1;
    rcOptions[BOXHORIZON] = 0;
    rcOptions[BOXPASSTHRU] = 0;
    rcOptions[BOXHEADFREE] = 0;
    rcOptions[BOXGPSHOME] = 0;
    rcOptions[BOXGPSHOLD] = out.mode == NF_GROUND || out.mode == NF_HOLD;
    if (out.mode == NF_GO || out.mode == NF_TAKEOFF || out.mode == NF_LAND)
        go();
    else
        leave(false);
    if (out.mode == NF_LAND)
        rcData[THROTTLE] = (int16_t)(cfg.rc_minchk - 10); /* starts and continues Autoland */
    else if (!out.pilots_throttle)
        climb(out.climb_cm_s);
}

bool FlightRun(bool rtl, bool flying)
{
    nf_settings_t settings;
    nf_input_t in;
    if (!flight.read)
        nf_start(&flight, read_record, NULL);
    get_settings(&settings);
    get_input(&in, rtl, flying);
    failsafe = false;
    grounded = flight.grounded;
    nf_step(&flight, &settings, &in, &out);
    if (nosed && !out.nose)
        magHold = heading;
    nosed = out.nose;
    if (out.mode == NF_PASS)
        leave(rtl && in.armed);
    else
        act();
    return out.mode != NF_PASS;
}

bool FlightIdles(void)
{
    const bool idles = out.mode == NF_GROUND || (grounded && launched && out.mode != NF_TAKEOFF);
    if (idles)
        launched = false;
    return idles;
}

bool FlightEndsAutostart(void)
{
    const bool ends = launched && out.mode != NF_TAKEOFF;
    if (ends)
        launched = false;
    return ends;
}

bool FlightAutostarts(void)
{
    if (out.mode == NF_TAKEOFF)
        launched = true;
    return out.mode == NF_TAKEOFF;
}

int32_t FlightAutostartHeight(int32_t otherwise_cm)
{
    return out.mode == NF_TAKEOFF ? out.takeoff_cm : otherwise_cm;
}

void FlightNose(void)
{
    if (out.nose)
        magHold = wrap_180((float)out.heading_cd * 0.01f);
}

static int16_t short_cm(int32_t value)
{
    return (int16_t)constrain(value, -32767, 32767);
}

static uint8_t flags(void)
{
    return (uint8_t)((cfg.mission_fly ? 1 : 0) | (flight.switch_on ? 2 : 0) | (out.mode != NF_PASS ? 4 : 0) |
                     (flight.battery_low ? 8 : 0));
}

int FlightRequest(uint8_t command, uint8_t *buffer, uint8_t size)
{
    if (command != FLIGHT)
        return -1;
    memset(buffer, 0, REPLY_SIZE);
    if (size) {
        buffer[0] = NM_BAD_REQUEST;
        return REPLY_SIZE;
    }
    buffer[1] = NF_VERSION;
    buffer[2] = flags();
    buffer[3] = (uint8_t)flight.state;
    buffer[4] = (uint8_t)flight.reason;
    buffer[5] = (uint8_t)out.mode;
    ns_put16(buffer + 6, flight.record);
    ns_put16(buffer + 8, flight.reached);
    ns_put16(buffer + 10, flight.count);
    ns_put32(buffer + 12, flight.distance_cm);
    ns_put16(buffer + 16, (uint16_t)flight.bearing_cd);
    ns_put16(buffer + 18, (uint16_t)short_cm(flight.height_error_cm));
    ns_put32(buffer + 20, flight.state == NF_OFF ? 0 : currentTimeMS - flight.entered_ms);
    return REPLY_SIZE;
}

bool FlightCurrent(uint16_t *record)
{
    *record = flight.record;
    return out.mode != NF_PASS && flight.record != NF_NO_RECORD;
}

bool FlightSummary(int32_t *summary)
{
    const uint32_t record = flight.record < 0xFFu ? flight.record : 0xFFu;
    *summary = (int32_t)((uint32_t)flight.state | (uint32_t)flight.reason << 8 | (uint32_t)flags() << 16 | record << 24);
    return cfg.mission_fly || flight.switch_on;
}

bool FlightReached(uint16_t *record)
{
    if (flight.reached == NF_NO_RECORD || flight.reached < announced)
        announced = NF_NO_RECORD;
    if (flight.reached == announced)
        return false;
    announced = announced == NF_NO_RECORD ? flight.reached : (uint16_t)(announced + 1u);
    *record = announced;
    return true;
}
