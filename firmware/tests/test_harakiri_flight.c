/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Tests of mission flight's Harakiri side: what it sets in the firmware, and that it gives everything back. */
#include "board.h"
#include "harakiri_flight.h"
#include "harakiri_mission.h"

#include <math.h>
#include <stdio.h>

config_t cfg;
flags_t f;
int16_t rcData[8], rcCommand[4];
uint8_t rcOptions[CHECKBOXITEMS], vbat;
int32_t Real_GPS_coord[2], GPS_home[2];
volatile uint8_t GPS_numSat;
volatile bool GPS_FIX;
bool GroundAltInitialized;
float EstAlt, vario, heading, magHold, angle[2], cos_yaw_x = 1.0f, sin_yaw_y;
int8_t nav_mode;
uint16_t GPS_speed, GPS_ground_course;
uint8_t GPS_update;
uint32_t currentTimeMS;
uint16_t batteryWarningVoltage;

static uint8_t list[4][16];
static unsigned checks;

#define CHECK(condition) check((condition), #condition, __LINE__)

static void check(bool condition, const char *what, int line)
{
    checks++;
    if (condition)
        return;
    printf("test_harakiri_flight.c:%d: failed: %s\n", line, what);
    exit(1);
}

bool feature(uint32_t mask)
{
    (void)mask;
    return false;
}

bool sensors(uint32_t mask)
{
    (void)mask;
    return true;
}

bool FloppyReadWP(uint16_t *number, wp_t *record)
{
    if (*number >= 4)
        return false;
    memcpy(record->bytes, list[*number], 16);
    return true;
}

nm_list_t MissionStored(void)
{
    nm_list_t stored = {nm_crc32(0, list[0], sizeof list), 4};
    return stored;
}

float wrap_180(float angle)
{
    return angle > 180.0f ? angle - 360.0f : angle;
}

static void make_list(void)
{
    static const uint8_t commands[4] = {0, 0, 0, 5}; /* home, fast corner, braked corner, LAND */
    for (int i = 0; i < 4; i++) {
        memset(list[i], 0, 16);
        ns_put32(list[i], (uint32_t)(450000000 + i * 3000));
        ns_put32(list[i] + 4, 80000000);
        list[i][8] = 10;
        list[i][12] = i == 2;
        list[i][13] = 2;
        list[i][15] = commands[i];
    }
}

static bool returns_home;

/* One 50 Hz loop of the firmware, with the pilot's sticks in the middle. */
static bool loop_once(bool switch_on)
{
    currentTimeMS += 20;
    GPS_update = !GPS_update;
    memset(rcOptions, 0, sizeof rcOptions);
    rcOptions[BOXGPSAUTO] = switch_on;
    rcData[THROTTLE] = 1510;
    return FlightRun(returns_home, f.ARMED != 0);
}

static void loops(int count)
{
    while (count--)
        (void)loop_once(true);
}

/* A place that jumps is not believed. */
static void fly_to(int32_t lat)
{
    while (Real_GPS_coord[LAT] != lat) {
        const int32_t way = lat - Real_GPS_coord[LAT];
        Real_GPS_coord[LAT] += constrain(way, -200, 200);
        loops(1);
    }
    loops(1);
}

static void take_off_by_hand(void)
{
    memset(&cfg, 0, sizeof cfg);
    FlightDefaults();
    cfg.mission_fly = 1;
    cfg.gps_wp_radius = 200;
    cfg.nav_speed_max = 350;
    cfg.rc_mid = 1500;
    cfg.rc_minchk = 1100;
    cfg.rc_maxchk = 1900;
    cfg.rc_dbah = 50;
    cfg.rc_dbgps = 5;
    cfg.bar_dscl = 0.7f;
    cfg.gps_maxangle = 35;
    cfg.al_barolr = cfg.as_clmbr = 50;
    cfg.mag_calibrated = 1;
    make_list();
    Real_GPS_coord[LAT] = 450000000;
    Real_GPS_coord[LON] = 80000000;
    GPS_FIX = GroundAltInitialized = true;
    GPS_numSat = 8;
    EstAlt = 1000.0f;
    f.GPS_FIX_HOME = 1;
    f.ARMED = 0;
    (void)loop_once(false);
    f.ARMED = 1;
    (void)loop_once(false);
}

/* The flight's lean, 1/10 degree: forward and right. */
static float lean(int axis)
{
    float angles[2] = {99.0f, 99.0f};
    FlightLean(angles);
    return angles[axis];
}

static uint8_t asked(int at)
{
    uint8_t reply[NM_BUFFER_SIZE];
    CHECK(FlightRequest(179, reply, 0) == 26);
    return reply[at];
}

static void test_settings(void)
{
    memset(&cfg, 0xFF, sizeof cfg);
    FlightDefaults();
    CHECK(cfg.mission_fly == 0 && cfg.mission_first == 200 && cfg.mission_height == 100 && cfg.mission_climb == 100);
    CHECK(cfg.mission_fix == 20 && cfg.mission_radius == 0 && cfg.mission_battery == 0);
    cfg.mission_first = 150;
    FlightDefaults();
    CHECK(cfg.mission_first == 150);
}

static void test_it_is_off_until_it_is_set(void)
{
    take_off_by_hand();
    cfg.mission_fly = 0;
    f.ARMED = 0;
    (void)loop_once(false);
    f.ARMED = 1;
    (void)loop_once(false);
    cfg.mission_fly = 1; /* in flight: too late */
    CHECK(!loop_once(true) && !f.GPS_AUTO_MODE && rcData[THROTTLE] == 1510 && asked(4) == NF_DISABLED);
    (void)loop_once(false);
}

static void test_a_leg_and_its_end(void)
{
    take_off_by_hand();
    CHECK(lean(PITCH) == 99.0f && !FlightTrustsGyro() && FlightHeading(10.0f) == 10.0f);
    loops(20);
    CHECK(f.GPS_AUTO_MODE && nav_mode == NAV_MODE_NONE && asked(3) == NF_LEG);
    CHECK(lean(PITCH) > 1.0f && lean(ROLL) < 1.0f && lean(ROLL) > -1.0f); /* the place is ahead, in the north */
    CHECK(FlightTrustsGyro() && FlightTrustsGyro() && FlightTrustsGyro() && FlightTrustsGyro() && !FlightTrustsGyro());
    CHECK(rcOptions[BOXBARO] && rcOptions[BOXMAG] && rcOptions[BOXANGLE] && !rcOptions[BOXGPSHOLD] && rcData[THROTTLE] == 1500);
    cos_yaw_x = 0.0f; /* the nose to the east: the place is on the left */
    sin_yaw_y = 1.0f;
    CHECK(lean(ROLL) < -1.0f && lean(PITCH) < 1.0f);
    cos_yaw_x = 1.0f;
    sin_yaw_y = 0.0f;
    heading = 10.0f;
    loops(1);
    FlightNose();
    CHECK(magHold > -36.0f && magHold < 1.0f);
    EstAlt = 500.0f;
    loops(1);
    CHECK(rcData[THROTTLE] > 1550 && rcData[THROTTLE] < 1640); /* climbs, within mission_climb */
    EstAlt = 1500.0f;
    loops(1);
    CHECK(rcData[THROTTLE] < 1450 && rcData[THROTTLE] > 1330);
    EstAlt = 1000.0f;
    fly_to(450002990); /* there */
    CHECK(asked(3) == NF_LEG && asked(8) == 1 && asked(6) == 2);
    CHECK(!loop_once(false) && !f.GPS_AUTO_MODE && rcData[THROTTLE] == 1510 && !rcOptions[BOXBARO] && lean(PITCH) == 99.0f);
}

/* What the accelerometer feels while the GPS says another direction turns the heading. */
static void test_the_compass_is_corrected(void)
{
    take_off_by_hand();
    for (int i = 0; i < 200; i++) {
        GPS_speed = (uint16_t)(i * 4);
        GPS_ground_course = 0; /* north */
        const float bearing = (FlightHeading(100.0f) - 10.0f) * RADX; /* a compass that is 90 degrees off */
        const float felt[2] = {-4.0f * cosf(bearing), -4.0f * sinf(bearing)}; /* ACC_speed's sign */
        FlightFeels(felt);
        (void)loop_once(true);
    }
    CHECK(FlightHeading(100.0f) < 25.0f && FlightHeading(100.0f) > -5.0f);
    CHECK((asked(2) & 16) != 0);
    f.ARMED = 0;
    (void)loop_once(false);
    CHECK(FlightHeading(100.0f) == 100.0f);
    GPS_speed = 0;
}

static void test_sticks_and_a_lost_fix(void)
{
    take_off_by_hand();
    loops(3);
    GPS_FIX = false;
    f.GPS_AUTO_MODE = 0; /* as GPS_alltime() does */
    loops(1);
    CHECK(rcOptions[BOXBARO] && !rcOptions[BOXGPSHOLD] && asked(3) == NF_NO_FIX && lean(PITCH) < 99.0f);
    GPS_FIX = true;
    loops(1);
    CHECK(rcOptions[BOXGPSHOLD] && asked(3) == NF_HELD && asked(4) == NF_FIX_LOST);
    (void)loop_once(false);
    loops(3);
    rcCommand[ROLL] = 6;
    loops(1);
    rcCommand[ROLL] = 0;
    CHECK(rcOptions[BOXGPSHOLD] && !f.GPS_AUTO_MODE && asked(4) == NF_STICKS);
    loops(5);
    CHECK(asked(3) == NF_HELD && rcData[THROTTLE] == 1510); /* the pilot's */
    (void)loop_once(false);
}

static void test_landing_and_announcements(void)
{
    uint16_t record;
    int32_t summary;
    cfg.mission_fly = 0;
    CHECK(!FlightSummary(&summary));
    cfg.mission_fly = 1;
    take_off_by_hand();
    loops(3);
    CHECK(FlightSummary(&summary) && summary == (NF_LEG | 7 << 16 | 1 << 24));
    CHECK(FlightCurrent(&record) && record == 1 && !FlightReached(&record));
    fly_to(450003000);
    CHECK(FlightReached(&record) && record == 1 && !FlightReached(&record));
    fly_to(450006000);
    CHECK(FlightReached(&record) && record == 2 && !FlightReached(&record));
    loops(2);
    CHECK((asked(3) == NF_SETTLE || asked(3) == NF_DESCENT) && f.GPS_AUTO_MODE);
    loops(2);
    CHECK(asked(3) == NF_DESCENT && rcData[THROTTLE] < cfg.rc_minchk);
    CHECK(f.GPS_AUTO_MODE && !rcOptions[BOXGPSHOLD]);
    f.ARMED = 0;
    CHECK(!loop_once(true) && !FlightCurrent(&record));
}

static void test_failsafe_and_the_port(void)
{
    uint8_t buffer[NM_BUFFER_SIZE];
    take_off_by_hand();
    loops(3);
    CHECK(FlightRequest(178, buffer, 0) == -1 && FlightRequest(179, buffer, 1) == 26 && buffer[0] == NM_BAD_REQUEST);
    FlightFailsafe();
    returns_home = true;
    CHECK(loop_once(true) && f.GPS_AUTO_MODE && asked(3) == NF_HOME && asked(4) == NF_FAILSAFE);
    FlightFailsafe();
    loops(1);
    CHECK(asked(3) == NF_HOME);
    returns_home = false; /* the signal is back */
    loops(2);
    CHECK(asked(3) == NF_HELD && asked(4) == NF_FAILSAFE);
    CHECK(!loop_once(false) && asked(3) == NF_OFF);
}

int main(void)
{
    test_settings();
    test_it_is_off_until_it_is_set();
    test_a_leg_and_its_end();
    test_the_compass_is_corrected();
    test_sticks_and_a_lost_fix();
    test_landing_and_announcements();
    test_failsafe_and_the_port();
    printf("  mission flight on Harakiri: %u checks passed\n", checks);
    return 0;
}
