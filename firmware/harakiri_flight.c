/* SPDX-License-Identifier: GPL-3.0-or-later */
/* See harakiri_flight.h. */
#include "harakiri_flight.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "board.h"
#include "harakiri_mission.h"
#include "mw.h"

/* The settings are in gaps of config_t, so that a build without them reads the same configuration. */
typedef char settings_fill_gaps[offsetof(config_t, gps_ins_vel) == offsetof(config_t, gps_type) + 4 &&
                                        offsetof(config_t, serial_baudrate) == offsetof(config_t, rtl_cr) + 3 &&
                                        offsetof(config_t, nav_ctrkgain) == offsetof(config_t, nav_tiltcomp) + 3 &&
                                        offsetof(config_t, nav_speed_max) == offsetof(config_t, nav_speed_min) + 2
                                    ? 1
                                    : -1];

enum { FLIGHT = 179, REPLY_SIZE = 26, GYRO_LOOPS = 4 };

extern uint16_t batteryWarningVoltage;

static nf_t flight;
static nf_output_t out;
static bool failsafe, launched, grounded, nosed;
static float felt[2];         /* since the last FlightRun(), cm/s */
static uint8_t gyro_loops;    /* since the accelerometer last corrected the attitude */
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
    set_default(&cfg.mission_fix, 5, 50, 20);
    set_default(&cfg.mission_battery, 0, 2, 0);
    if (cfg.mission_radius > 2000)
        cfg.mission_radius = 0;
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
    settings->fence_m = cfg.mission_radius;
    settings->climb_cm_s = cfg.mission_climb;
    settings->launch_cm_s = cfg.as_clmbr;
    settings->landing_cm_s = cfg.al_barolr;
    settings->speed_cm_s = cfg.nav_speed_max;
    settings->fix_s = cfg.mission_fix;
    settings->home_m = cfg.rtl_mnh;
    settings->lean_cd = (uint16_t)(cfg.gps_maxangle * 100);
    settings->failsafe_lands = cfg.fs_jstph != 0;
    settings->battery = (nf_battery_t)cfg.mission_battery;
}

static void get_motion(nf_input_t *in)
{
    static uint8_t fix;
    const float course = (float)GPS_ground_course * (RADX * 0.1f);
    /* Harakiri's angles are in 1/10 degree; forward and right are positive. */
    const float ahead = angle[PITCH] * 10.0f, right = angle[ROLL] * 10.0f;
    in->velocity.n = (float)GPS_speed * cosf(course);
    in->velocity.e = (float)GPS_speed * sinf(course);
    in->new_fix = GPS_update != fix;
    fix = GPS_update;
    in->lean_cd.n = ahead * cos_yaw_x - right * sin_yaw_y;
    in->lean_cd.e = ahead * sin_yaw_y + right * cos_yaw_x;
    in->felt.n = felt[LAT];
    in->felt.e = felt[LON];
    felt[LAT] = felt[LON] = 0.0f;
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
    get_motion(in);
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
    in->battery_low = battery_low();
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

static void act(void)
{
    rcOptions[BOXBARO] = 1;
    rcOptions[BOXMAG] = 1;
    rcOptions[BOXANGLE] = 1;
    rcOptions[BOXHORIZON] = 0;
    rcOptions[BOXPASSTHRU] = 0;
    rcOptions[BOXHEADFREE] = 0;
    rcOptions[BOXGPSHOME] = 0;
    /* For the boxes that telemetry reports; what Harakiri's navigation makes of them is replaced by FlightLean(). */
    rcOptions[BOXGPSHOLD] = out.mode == NF_GROUND || out.mode == NF_HOLD;
    f.GPS_AUTO_MODE = out.mode == NF_GO || out.mode == NF_TAKEOFF || out.mode == NF_LAND;
    if (f.GPS_AUTO_MODE)
        nav_mode = NAV_MODE_NONE;
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
        f.GPS_AUTO_MODE = 0;
    else
        act();
    return out.mode != NF_PASS;
}

/* The compass's correction is true until the craft is disarmed. Before the first flight it is not used. */
float FlightHeading(float measured)
{
    return flight.used ? wrap_180(measured + (float)out.correction_cd * 0.01f) : measured;
}

void FlightFeels(const float *change)
{
    felt[LAT] -= change[LAT];
    felt[LON] -= change[LON];
}

bool FlightTrustsGyro(void)
{
    if (out.steer == ST_NONE || gyro_loops >= GYRO_LOOPS)
        gyro_loops = 0;
    else
        gyro_loops++;
    return gyro_loops != 0;
}

void FlightLean(float *lean)
{
    if (out.steer == ST_NONE)
        return;
    lean[ROLL] = (out.lean_cd.e * cos_yaw_x - out.lean_cd.n * sin_yaw_y) * 0.1f;
    lean[PITCH] = (out.lean_cd.e * sin_yaw_y + out.lean_cd.n * cos_yaw_x) * 0.1f;
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
                     (flight.battery_low ? 8 : 0) | (flight.steer.compass_known ? 16 : 0));
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
    ns_put16(buffer + 24, (uint16_t)-flight.steer.correction_cd);
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
