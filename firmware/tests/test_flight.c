/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The flight core flies random lists on a point-mass craft with wind, while its sensors lie (lies_t), and the pilot's
 * switches and sticks, the fix and failsafe change at random. Usage: test-flight [LISTS [SEED]]
 *
 * Each call is checked (check_step), and each flight (check_flight). A failure prints its seed.
 */
#include "naze_flight.h"
#include "reference.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_RECORDS = 9, HISTORY = 32, RADIUS_CM = 200, LIMIT_S = 900 };
#define STEP_MS 20 /* macros, because clang 19 warns of enumerators in floating-point expressions */
#define CRUISE_CM_S 350
#define LEAN_CD 3500
#define GRAVITY 980.665
#define FLYAWAY_CM 60000
#define RADIAN_CD (18000 / acos(-1))

enum { WAYPOINT, LOITER_UNLIM, LOITER_TURNS, LOITER_TIME, RETURN_TO_LAUNCH, LAND, TAKEOFF, SETROI };

#define DEGREE 1e7
#define CM 1.113195 /* per 1e-7 degree of latitude */
#define LAT0 450000000
#define LON0 80000000

static unsigned long checks, seed;
static unsigned long seen_states[NF_STATES], seen_reasons[NF_REASONS];
static unsigned reads;

#define CHECK(condition) check((condition), #condition, __LINE__)

static void explain(void);

static void check(bool condition, const char *what, int line)
{
    checks++;
    if (condition)
        return;
    printf("test_flight.c:%d: seed %lu: failed: %s\n", line, seed, what);
    explain();
    exit(1);
}

/* ---- chance ----------------------------------------------------------------------------------------------------------- */

static uint64_t chance_state;

static uint32_t random32(void)
{
    chance_state ^= chance_state << 13;
    chance_state ^= chance_state >> 7;
    chance_state ^= chance_state << 17;
    return (uint32_t)(chance_state * 0x2545F4914F6CDD1Du >> 32);
}

static int between(int low, int high)
{
    return low + (int)(random32() % (uint32_t)(high - low + 1));
}

static bool one_in(uint32_t n)
{
    return random32() % n == 0;
}

static double noise(void) /* about normal, deviation 1 */
{
    double sum = 0;
    for (int i = 0; i < 6; i++)
        sum += random32() / 4294967296.0 - 0.5;
    return sum * sqrt(2.0);
}

/* ---- lists ------------------------------------------------------------------------------------------------------------ */

typedef struct {
    uint16_t count;
    uint8_t bytes[MAX_RECORDS + 1][NM_RECORD_SIZE];
    nf_record_t record[MAX_RECORDS + 1];
} list_t;

static list_t list;

static nf_place_t place_at(double north_cm, double east_cm)
{
    nf_place_t place;
    place.lat = LAT0 + (int32_t)lround(north_cm / CM);
    place.lon = LON0 + (int32_t)lround(east_cm / CM / cos(LAT0 / DEGREE * acos(-1) / 180));
    return place;
}

static void encode(uint8_t *bytes, const nf_record_t *record)
{
    ns_put32(bytes, (uint32_t)record->place.lat);
    ns_put32(bytes + 4, (uint32_t)record->place.lon);
    ns_put16(bytes + 8, (uint16_t)record->height_m);
    ns_put16(bytes + 10, record->roi ? 1 : 0);
    bytes[12] = record->seconds;
    bytes[13] = record->radius_m;
    bytes[14] = (uint8_t)record->turns;
    bytes[15] = record->command;
}

static void add(const nf_record_t *record)
{
    list.record[list.count] = *record;
    encode(list.bytes[list.count++], record);
}

static nm_list_t identity(void)
{
    nm_list_t identity;
    identity.count = list.count;
    identity.checksum = list.count ? bitwise_crc32(list.bytes[0], list.count * NM_RECORD_SIZE) : 0;
    return identity;
}

static nf_record_t random_record(int command)
{
    nf_record_t record;
    memset(&record, 0, sizeof record);
    record.command = (uint8_t)command;
    record.place = place_at(between(-5000, 5000), between(-5000, 5000));
    record.height_m = (int16_t)between(2, 25);
    record.radius_m = (uint8_t)between(2, 6);
    record.roi = one_in(3);
    if (command == WAYPOINT)
        record.seconds = (uint8_t)between(0, 1);
    if (command == LOITER_TIME)
        record.seconds = (uint8_t)between(1, 12);
    if (command == LOITER_TURNS)
        record.turns = (int8_t)(one_in(2) ? between(1, 2) : -between(1, 2));
    return record;
}

/* A legal list: home, perhaps TAKEOFF, records, perhaps one that can only be the last. */
static void make_list(bool takes_off)
{
    static const int middle[] = {WAYPOINT, WAYPOINT, WAYPOINT, LOITER_TURNS, LOITER_TIME, RETURN_TO_LAUNCH, SETROI};
    const int last[] = {WAYPOINT, LOITER_TIME, LOITER_TURNS, LOITER_UNLIM, LAND, LAND};
    nf_record_t record = random_record(WAYPOINT);
    const int more = between(1, MAX_RECORDS - 3);
    list.count = 0;
    add(&record);
    if (takes_off) {
        record = random_record(TAKEOFF);
        record.height_m = (int16_t)between(2, 15);
        add(&record);
    }
    for (int i = 0; i < more; i++) {
        record = random_record(middle[between(0, 6)]);
        add(&record);
    }
    record = random_record(last[between(0, 5)]);
    add(&record);
}

static bool read_record(void *self, uint16_t number, uint8_t *record)
{
    (void)self;
    reads++;
    if (number >= list.count)
        return false;
    memcpy(record, list.bytes[number], NM_RECORD_SIZE);
    return true;
}

/* ---- the craft -------------------------------------------------------------------------------------------------------- */

/* What is wrong with the craft; all 0 except mass and lag: a good one. */
typedef struct {
    double mass;      /* kg */
    double lag_s;     /* of the GPS */
    double compass;   /* degrees, clockwise */
    double magnetism; /* of the motors: the greatest further error, which turns with the nose */
    double jump_cm;   /* of the GPS's place, northward, ... */
    double jump_s;    /* ... at this time */
    double drift_cm_s, baro_cm_s, level; /* of place and height; degrees */
    double vibration; /* cm/s of each call's `felt` */
} lies_t;

typedef struct {
    double n, e;
} vector_t;

typedef struct {
    lies_t lies;
    vector_t at, v;                 /* cm, cm/s over ground */
    vector_t lean, mislevel, felt;  /* radians: true, and unseen by the attitude; cm/s */
    vector_t old_at[HISTORY], old_v[HISTORY];
    vector_t wind, gust, wander;
    double height, climb, heading;  /* degrees, not wrapped */
    double time_s, baro_cm;
    nf_place_t measured;
    vector_t measured_v;
    bool new_fix, aloft, flying, armed, crashed;
    double lift_s, ground_s, seen_s; /* with a fix */
    int32_t correction_cd;          /* that the heading has */
} craft_t;

static craft_t craft;

static const lies_t honest = {1.0, 0.2, 0, 0, 0, 0, 0, 0, 0, 0.5};

static lies_t random_lies(void)
{
    lies_t lies = honest;
    lies.mass = between(50, 200) / 100.0;
    lies.lag_s = between(10, 50) / 100.0;
    if (one_in(2))
        lies.compass = between(-45, 45);
    if (one_in(4))
        lies.magnetism = between(0, 15);
    lies.level = between(-20, 20) / 10.0;
    lies.vibration = between(5, 15) / 10.0;
    lies.baro_cm_s = one_in(3) ? between(-3, 3) : 0;
    return lies;
}

static void reset_craft(bool aloft, const lies_t *lies)
{
    memset(&craft, 0, sizeof craft);
    craft.lies = *lies;
    craft.armed = true;
    craft.aloft = craft.flying = aloft;
    craft.height = aloft ? between(150, 2500) : 0;
    craft.at.n = between(-1000, 1000);
    craft.at.e = between(-1000, 1000);
    craft.heading = between(0, 359);
    const double wind = between(0, 800), from = between(0, 628) / 100.0;
    craft.wind.n = wind * cos(from);
    craft.wind.e = wind * sin(from);
    if (aloft) { /* leans into the wind, as a pilot's position hold does */
        craft.lean.n = -craft.wind.n * 0.25 / lies->mass / GRAVITY;
        craft.lean.e = -craft.wind.e * 0.25 / lies->mass / GRAVITY;
    }
    for (int i = 0; i < HISTORY; i++)
        craft.old_at[i] = craft.at;
    craft.measured = place_at(craft.at.n, craft.at.e);
}

static vector_t turned(vector_t a, double degrees)
{
    const double c = cos(degrees * acos(-1) / 180), si = sin(degrees * acos(-1) / 180);
    return (vector_t){a.n * c - a.e * si, a.n * si + a.e * c};
}

/* How far the heading that the firmware uses is off, degrees. */
static double heading_error(void)
{
    return craft.lies.compass + craft.lies.magnetism * sin(craft.heading * acos(-1) / 180) + craft.correction_cd / 100.0;
}

/* A pilot who has the craft keeps it where it is. */
static vector_t by_hand(void)
{
    const double drag = 0.25 / craft.lies.mass;
    return (vector_t){(-craft.v.n - craft.wind.n * drag) / GRAVITY, (-craft.v.e - craft.wind.e * drag) / GRAVITY};
}

static void lean_craft(const nf_output_t *out, double dt)
{
    const vector_t asked = {out->lean_cd.n / RADIAN_CD, out->lean_cd.e / RADIAN_CD};
    vector_t lean = out->steer == ST_NONE ? (vector_t){0, 0} : turned(asked, -heading_error());
    if (out->mode == NF_PASS)
        lean = by_hand();
    lean.n += craft.mislevel.n + craft.lies.level * acos(-1) / 180;
    lean.e += craft.mislevel.e;
    craft.lean.n += (lean.n - craft.lean.n) * dt / 0.2;
    craft.lean.e += (lean.e - craft.lean.e) * dt / 0.2;
}

static void push(double *at, double *v, double *mislevel, double *felt, double lean, double wind, double dt)
{
    const double acceleration = GRAVITY * tan(fmax(-1.2, fmin(1.2, lean))) + 0.25 / craft.lies.mass * (wind - *v);
    *mislevel += (acceleration / GRAVITY - *mislevel) * dt / 8;
    *felt += (acceleration - *mislevel * GRAVITY) * dt;
    *v += acceleration * dt;
    *at += *v * dt;
}

static double lean_of_craft(void)
{
    return sqrt(craft.lean.n * craft.lean.n + craft.lean.e * craft.lean.e) * 180 / acos(-1);
}

/* A crash as in simulator/sky/body.py. A craft drifts, so it may be faster, without a fix, or if a take-off is stopped. */
static void touch_down(const nf_output_t *out, double dt)
{
    const double most = out->mode == NF_LAND && craft.seen_s > 5 ? 300 : 800;
    const double speed = sqrt(craft.v.n * craft.v.n + craft.v.e * craft.v.e);
    if (craft.aloft && craft.ground_s == 0 && (craft.climb < -250 || speed > most || lean_of_craft() > 35))
        craft.crashed = true;
    craft.height = 0;
    craft.ground_s += dt;
    craft.armed = out->mode != NF_LAND || craft.ground_s < 3;
    craft.v.n = craft.v.e = craft.climb = 0;
    craft.lean = craft.mislevel = (vector_t){0, 0};
}

static void move_craft(const nf_output_t *out)
{
    const double dt = STEP_MS / 1000.0;
    const double gusts = fmax(100, 0.2 * hypot(craft.wind.n, craft.wind.e));
    double climb = 0;
    craft.time_s += dt;
    craft.baro_cm = fmax(-100, fmin(100, craft.baro_cm + craft.lies.baro_cm_s * dt)); /* more flies a low list into the ground */
    craft.gust.n += -craft.gust.n * dt / 3 + noise() * gusts * sqrt(2 * dt / 3);
    craft.gust.e += -craft.gust.e * dt / 3 + noise() * gusts * sqrt(2 * dt / 3);
    switch (out->mode) {
    case NF_TAKEOFF:
        craft.lift_s += dt;
        if (craft.lift_s > 1)
            craft.flying = true;
        if (craft.lift_s > 3)
            craft.aloft = true;
        climb = craft.height < out->takeoff_cm ? 100 : 0;
        break;
    case NF_LAND:
        climb = -80;
        break;
    case NF_GROUND:
        CHECK(!craft.aloft || craft.height < 100);
        craft.lift_s = 0;
        climb = -100;
        break;
    default:
        climb = out->climb_cm_s;
        break;
    }
    if (!craft.aloft)
        return;
    lean_craft(out, dt);
    for (int i = 0; i < 2; i++) {
        push(&craft.at.n, &craft.v.n, &craft.mislevel.n, &craft.felt.n, craft.lean.n, craft.wind.n + craft.gust.n, dt / 2);
        push(&craft.at.e, &craft.v.e, &craft.mislevel.e, &craft.felt.e, craft.lean.e, craft.wind.e + craft.gust.e, dt / 2);
    }
    craft.climb += (climb - craft.climb) * dt / 0.4;
    craft.height += craft.climb * dt;
    if (craft.height <= 0)
        touch_down(out, dt);
    if (out->nose) {
        const double off = remainder(out->heading_cd / 100.0 - craft.heading - heading_error(), 360);
        craft.heading += fmax(-30, fmin(30, off * 1.5)) * dt;
    }
}

static void measure(const nf_output_t *out)
{
    const int steps = (int)lround(craft.time_s * 1000 / STEP_MS), lag = (int)lround(craft.lies.lag_s * 1000 / STEP_MS);
    const double jump = craft.time_s > craft.lies.jump_s ? craft.lies.jump_cm : 0;
    craft.correction_cd = out->correction_cd;
    craft.old_at[steps % HISTORY] = craft.at;
    craft.old_v[steps % HISTORY] = craft.v;
    craft.new_fix = steps % 10 == 0;
    if (!craft.new_fix)
        return;
    craft.wander.n += -craft.wander.n / 300 + noise() * 70 * sqrt(2.0 / 300);
    craft.wander.e += -craft.wander.e / 300 + noise() * 70 * sqrt(2.0 / 300);
    const vector_t at = craft.old_at[(steps + HISTORY - lag) % HISTORY];
    craft.measured = place_at(at.n + craft.wander.n + jump + craft.lies.drift_cm_s * craft.time_s, at.e + craft.wander.e);
    craft.measured_v = craft.old_v[(steps + HISTORY - lag) % HISTORY];
    craft.measured_v.n += noise() * 5 + craft.lies.drift_cm_s;
    craft.measured_v.e += noise() * 5;
}

/* ---- a flight --------------------------------------------------------------------------------------------------------- */

static nf_settings_t settings = {true, RADIUS_CM, 250, 100, 0, 100, 100, 50, CRUISE_CM_S, 20, 8, LEAN_CD, false, NF_BATTERY_TOLD};

typedef struct {
    nf_t core;
    nf_input_t in;
    nf_output_t out;
    /* As the checks see it. */
    nf_state_t state;
    uint32_t entered_ms;
    double turned, heading_before, low, high;
    uint16_t record;
    bool touched; /* since the state was entered */
    bool toggled;
} flight_t;

static const flight_t *flown;

static void explain(void)
{
    if (!flown)
        return;
    const nf_t *core = &flown->core;
    printf("  %.1f s: state %s before %s, reason %d, record %u, %.1f m to go; fix %d, stick %d, failsafe %d, rtl %d; true: %.1f m/s, lean %.0f, "
           "%.0f m north, %.0f m east, %.1f m high; compass %.0f, corrected %.0f, mass %.1f, wind %.1f m/s\n",
           craft.time_s, nf_states[core->state].name, nf_states[flown->state].name, core->reason, core->record,
           core->distance_cm / 100.0, flown->in.fix, flown->in.stick, flown->in.failsafe, flown->in.rtl,
           sqrt(craft.v.n * craft.v.n + craft.v.e * craft.v.e) / 100, lean_of_craft(), craft.at.n / 100, craft.at.e / 100,
           craft.height / 100, craft.lies.compass, craft.correction_cd / 100.0, craft.lies.mass,
           sqrt(craft.wind.n * craft.wind.n + craft.wind.e * craft.wind.e) / 100);
}

static double bearing_to(const nf_place_t *to)
{
    int32_t bearing;
    (void)nf_distance(&craft.measured, to, &bearing);
    return bearing / 100.0;
}

static const nf_place_t *roi_before(uint16_t number)
{
    while (number-- > 0)
        if (list.record[number].command == SETROI)
            return &list.record[number].place;
    return NULL;
}

static bool is_known_place(const nf_place_t *place, const nf_input_t *in)
{
    for (uint16_t i = 0; i < list.count; i++)
        if (!memcmp(place, &list.record[i].place, sizeof *place))
            return true;
    return !memcmp(place, &in->home, sizeof *place);
}

static void check_leave(flight_t *flight, const nf_record_t *record, uint32_t now)
{
    const nf_t *core = &flight->core;
    const uint32_t took = now - flight->entered_ms;
    const bool went_on = core->state == NF_NEXT || core->state == NF_LEG || core->state == NF_SETTLE || core->state == NF_DONE;
    if (flight->state == NF_LOITER && went_on)
        CHECK(labs((long)took - record->seconds * 1000) <= 1000);
    if (flight->state == NF_TURN && went_on && !flight->touched)
        CHECK(fabs(flight->turned - record->turns * 360.0) <= 15);
    if (flight->state == NF_LEG && (went_on || core->state == NF_LOITER || core->state == NF_TURN || core->state == NF_STAY)) {
        const nf_place_t *place = record->command == RETURN_TO_LAUNCH ? &flight->in.home
                                  : record->command == TAKEOFF        ? &list.record[0].place
                                                                      : &record->place;
        const unsigned radius = record->command <= LOITER_TIME && record->radius_m * 100 > RADIUS_CM ? record->radius_m * 100u : RADIUS_CM;
        CHECK(nf_distance(&flight->in.place, place, NULL) <= radius + 1); /* as believed */
        CHECK(core->reached == flight->record || core->state == NF_DONE || list.record[core->reached].command == SETROI);
    }
}

static void check_step(flight_t *flight)
{
    const nf_t *core = &flight->core;
    const nf_input_t *in = &flight->in;
    const nf_output_t *out = &flight->out;
    const nf_state_t before = flight->state;
    const uint16_t number = flight->record;

    seen_states[core->state]++;
    seen_reasons[core->reason]++;
    CHECK(core->state < NF_STATES && core->reason < NF_REASONS && out->mode <= NF_LAND);
    CHECK(reads <= 20);
    CHECK(!out->nose || (out->heading_cd >= 0 && out->heading_cd < 36000));
    CHECK(labs(out->climb_cm_s) <= settings.climb_cm_s);
    CHECK(out->mode == NF_PASS || (in->armed && in->switch_on));
    CHECK(out->mode != NF_LAND || list.record[list.count - 1].command == LAND || core->reason >= NF_RTL || core->reason == NF_LAND_SLOW);
    CHECK(out->lean_cd.n * out->lean_cd.n + out->lean_cd.e * out->lean_cd.e <= 1.001f * LEAN_CD * LEAN_CD);
    CHECK(out->steer == ST_NONE || (out->mode != NF_PASS && out->mode != NF_GROUND && in->flying));
    if (fabs(craft.lies.compass) <= 60)
        CHECK(!craft.crashed && sqrt(craft.v.n * craft.v.n + craft.v.e * craft.v.e) < 1600 && lean_of_craft() < 60);
    CHECK(fabs(craft.at.n) < FLYAWAY_CM && fabs(craft.at.e) < FLYAWAY_CM);
    CHECK(out->mode != NF_TAKEOFF || list.record[1].command == TAKEOFF);
    if (out->mode == NF_GO && core->record > 0 && core->state == NF_LEG)
        CHECK(is_known_place(&out->target, in));
    if (in->rtl || in->failsafe)
        CHECK(core->state == NF_OFF || core->reason == NF_RTL || core->reason == NF_FAILSAFE || core->reason == NF_BATTERY || in->stick || core->reason >= NF_AWAY || core->reason == NF_LAND_SLOW || core->state == NF_DESCENT || core->state == NF_SINK || before == NF_DESCENT || before == NF_SINK || flight->toggled);
    if (core->state == NF_DESCENT || core->state == NF_SINK)
        CHECK(out->mode == (core->waits ? NF_HOLD : NF_LAND));
    CHECK(!core->waits || (core->state == NF_DESCENT && in->fix && !in->battery_low));
    if (settings.fence_m && core->state >= NF_NEXT && core->state <= NF_STAY && craft.lies.jump_cm == 0 && craft.lies.drift_cm_s == 0)
        CHECK(hypot(craft.at.n, craft.at.e) < settings.fence_m * 100 + 1600);
    if (in->stick && !in->failsafe && before != NF_OFF)
        CHECK(core->state == NF_OFF || core->state == NF_HELD || core->state == NF_NO_FIX || core->state == NF_HOME);
    if (!in->fix)
        CHECK(out->mode == NF_PASS || out->mode == NF_LEVEL || out->mode == NF_GROUND || out->mode == NF_LAND);
    if (before == NF_OFF && core->state != NF_OFF)
        CHECK(flight->toggled);
    if (before == NF_HELD && core->state != NF_OFF)
        CHECK(core->state == NF_HELD || core->state == NF_NO_FIX || core->state == NF_SINK || in->rtl || in->failsafe || core->battery_acts || flight->toggled);
    if (nf_states[core->state].rule != NF_FOREVER && core->state == before)
        CHECK(in->now_ms - core->entered_ms <= core->allowed_ms);
    if (core->state == NF_LEG && before == NF_LEG && number == core->record && !flight->toggled) {
        const double height = craft.height + craft.baro_cm;
        const double target = core->now.command == TAKEOFF ? flight->high : core->now.height_m * 100.0;
        CHECK(height >= fmin(flight->low, target) - 300 && height <= fmax(flight->high, target) + 300);
        const nf_record_t *record = &list.record[number];
        CHECK(!out->steer || (out->steer == ST_PASS) == (record->command == WAYPOINT && record->seconds == 0) || in->stick);
        const nf_place_t *roi = record->roi && record->command <= LOITER_TIME ? roi_before(number) : NULL;
        if (!flight->touched && craft.lies.compass == 0 && craft.lies.magnetism == 0 && craft.lies.jump_cm == 0 && craft.height > 0 && in->now_ms - flight->entered_ms > 15000) {
            const nf_place_t *to = roi ? roi : &out->target;
            if (nf_distance(&craft.measured, to, NULL) > 2500)
                CHECK(fabs(remainder(bearing_to(to) - craft.heading, 360)) <= 25);
        }
    }
    if (core->state != before || core->record != number || flight->toggled) {
        if (core->state == NF_LEG || core->state == NF_NEXT)
            CHECK(core->record >= number || flight->toggled || number == NF_NO_RECORD);
        if (before != NF_OFF && number != NF_NO_RECORD && number < list.count && !flight->toggled)
            check_leave(flight, &list.record[number], in->now_ms);
        flight->state = core->state;
        flight->record = core->record;
        flight->entered_ms = in->now_ms;
        flight->turned = 0;
        flight->touched = in->yaw_stick;
        flight->low = flight->high = craft.height + craft.baro_cm;
    } else if (core->state == NF_TURN)
        flight->turned += craft.heading - flight->heading_before;
    flight->heading_before = craft.heading;
}

/* Things that happen in the sky and in the pilot's hands; `rate`: the mean number of steps between them. */
static void happen(flight_t *flight, uint32_t rate)
{
    nf_input_t *in = &flight->in;
    const bool was_on = in->switch_on;
    in->yaw_stick = in->yaw_stick ? !one_in(50) : one_in(rate);
    in->stick = in->stick ? !one_in(50) : one_in(rate * 2);
    in->fix = in->fix ? !one_in(rate * 2) : one_in(300);
    in->failsafe = in->failsafe ? !one_in(1000) : one_in(rate * 5);
    in->stick = in->stick && !in->failsafe;
    in->rtl = in->rtl ? !one_in(1000) : one_in(rate * 5);
    in->throttle_middle = in->throttle_middle ? !one_in(rate * 2) : one_in(50);
    in->switch_on = in->switch_on ? !one_in(rate) : one_in(100);
    if (one_in(rate * 20))
        in->list.checksum++;
    if (one_in(rate * 10))
        in->battery_low = true;
    flight->toggled = in->switch_on && !was_on;
    if (in->stick || in->yaw_stick || !in->throttle_middle || !in->fix || flight->toggled)
        flight->touched = true;
}

static void sense(flight_t *flight)
{
    nf_input_t *in = &flight->in;
    in->now_ms += STEP_MS;
    const vector_t felt = turned(craft.felt, heading_error());
    const vector_t lean = turned((vector_t){craft.lean.n - craft.mislevel.n - craft.lies.level * acos(-1) / 180, craft.lean.e - craft.mislevel.e}, heading_error());
    in->place = craft.measured;
    in->velocity.n = (float)craft.measured_v.n;
    in->velocity.e = (float)craft.measured_v.e;
    in->new_fix = craft.new_fix;
    in->felt.n = (float)(felt.n + noise() * craft.lies.vibration);
    in->felt.e = (float)(felt.e + noise() * craft.lies.vibration);
    craft.felt.n = craft.felt.e = 0;
    in->lean_cd.n = (float)(lean.n * RADIAN_CD);
    in->lean_cd.e = (float)(lean.e * RADIAN_CD);
    in->height_cm = (int32_t)lround(craft.height + craft.baro_cm + noise() * 5);
    in->climb_cm_s = (int32_t)lround(craft.climb + noise() * 5);
    in->heading_cd = (int32_t)lround(remainder(craft.heading + heading_error(), 360) * 100);
    in->flying = craft.flying;
    in->armed = craft.armed;
    craft.seen_s = in->fix ? craft.seen_s + STEP_MS / 1000.0 : 0;
}

static void step(flight_t *flight)
{
    sense(flight);
    reads = 0;
    nf_step(&flight->core, &settings, &flight->in, &flight->out);
    check_step(flight);
    move_craft(&flight->out);
    measure(&flight->out);
}

static void switch_on(flight_t *flight)
{
    flight->in.switch_on = flight->toggled = true;
    step(flight);
    flight->toggled = false;
}

static void prepare_with(flight_t *flight, bool aloft, const lies_t *lies)
{
    memset(flight, 0, sizeof *flight);
    flown = flight;
    nf_start(&flight->core, read_record, NULL);
    flight->record = NF_NO_RECORD;
    flight->in.now_ms = 0u - (uint32_t)between(0, 100000); /* wraps during the flight */
    flight->in.home = place_at(0, 0);
    flight->in.list = identity();
    flight->in.fix = flight->in.home_known = flight->in.instruments = flight->in.throttle_middle = true;
    reset_craft(aloft, lies);
    craft.armed = false;
    step(flight);
    craft.armed = true;
    step(flight);
}

static void prepare(flight_t *flight, bool aloft)
{
    prepare_with(flight, aloft, &honest);
}

static bool is_over(const flight_t *flight)
{
    switch (flight->core.state) {
    case NF_OFF:
    case NF_STAY:
    case NF_DONE:
    case NF_HELD:
        return true;
    default:
        return false;
    }
}

/* One list in an undisturbed sky must be flown to its end. */
static void fly_undisturbed(void)
{
    static flight_t flight;
    const bool takes_off = one_in(2);
    make_list(takes_off);
    const lies_t lies = random_lies();
    settings.battery = NF_BATTERY_TOLD;
    settings.fence_m = 0;
    prepare_with(&flight, !takes_off, &lies);
    switch_on(&flight);
    for (int i = 0; i < LIMIT_S * 1000 / STEP_MS && !is_over(&flight) && craft.armed; i++)
        step(&flight);
    const uint8_t last = list.record[list.count - 1].command;
    if (flight.core.state == NF_HELD)
        CHECK(flight.core.reason == NF_ON_GROUND ? !takes_off : flight.core.reason == NF_BAD_ORDER ? list.count == 2 : lies.mass < 0.8 && flight.core.reason == NF_STALLED);
    else if (last == LAND)
        CHECK(!craft.armed && nf_distance(&craft.measured, &flight.core.target, NULL) <= 2 * RADIUS_CM);
    else
        CHECK(flight.core.state == (last == LOITER_UNLIM ? NF_STAY : NF_DONE));
    flight.in.switch_on = false;
    step(&flight);
    CHECK(flight.out.mode == NF_PASS);
}

static void fly_disturbed(void)
{
    static flight_t flight;
    const uint32_t rate = (uint32_t)between(200, 6000);
    const bool takes_off = one_in(2);
    make_list(takes_off);
    lies_t lies = random_lies();
    lies.jump_s = between(10, 100);
    lies.jump_cm = one_in(4) ? between(-3000, 3000) : 0;
    lies.drift_cm_s = one_in(8) ? between(-50, 50) : 0;
    if (one_in(8))
        lies.compass = between(-180, 180);
    settings.battery = (nf_battery_t)between(0, 2);
    settings.fence_m = one_in(4) ? (uint16_t)between(30, 80) : 0;
    prepare_with(&flight, !takes_off || one_in(3), &lies);
    for (int i = 0; i < 180 * 1000 / STEP_MS && craft.armed; i++) {
        happen(&flight, rate);
        step(&flight);
    }
}

/* ---- refusals, one by one --------------------------------------------------------------------------------------------- */

static nf_reason_t refusal(void (*spoil)(flight_t *flight))
{
    static flight_t flight;
    nf_record_t record;
    list.count = 0;
    record = random_record(WAYPOINT);
    add(&record);
    record.place = place_at(3000, 0);
    add(&record);
    add(&record);
    prepare(&flight, true);
    craft.height = 1000;
    craft.at.n = craft.at.e = 0;
    spoil(&flight);
    flight.in.switch_on = flight.toggled = true;
    for (int i = 0; i < 30; i++) {
        step(&flight);
        flight.toggled = false;
        CHECK(flight.core.state == NF_OFF || flight.core.state == NF_CHECK || flight.core.state == NF_HELD || flight.core.reason == NF_OK);
    }
    return flight.core.reason;
}

static void rearm(flight_t *flight)
{
    flight->in.list = identity();
    craft.armed = false;
    step(flight);
    craft.armed = true;
    step(flight);
}

static void nothing(flight_t *flight) { (void)flight; }
static void no_fix(flight_t *flight) { flight->in.fix = false; }
static void no_home(flight_t *flight) { flight->in.home_known = false; }
static void no_compass(flight_t *flight) { flight->in.instruments = false; }
static void changed(flight_t *flight) { flight->in.list.checksum++; }
static void damaged(flight_t *flight) { (void)flight; list.bytes[2][8] ^= 1; }
static void empty(flight_t *flight) { list.count = 1; rearm(flight); }
static void low(flight_t *flight) { (void)flight; craft.height = 50; }
static void far(flight_t *flight) { list.record[1].place = place_at(26000, 0); encode(list.bytes[1], &list.record[1]); rearm(flight); }
static void long_leg(flight_t *flight) { list.record[2].place = place_at(-198000, 0); encode(list.bytes[2], &list.record[2]); rearm(flight); }
static void high(flight_t *flight) { list.record[2].height_m = 101; encode(list.bytes[2], &list.record[2]); rearm(flight); }
static void placeless(flight_t *flight) { list.record[2].place.lat = 0; encode(list.bytes[2], &list.record[2]); rearm(flight); }
static void unknown(flight_t *flight) { list.record[2].command = 8; encode(list.bytes[2], &list.record[2]); rearm(flight); }
static void landing_first(flight_t *flight) { list.record[1].command = LAND; encode(list.bytes[1], &list.record[1]); rearm(flight); }
static void late_takeoff(flight_t *flight) { list.record[2].command = TAKEOFF; encode(list.bytes[2], &list.record[2]); rearm(flight); }
static void roi_last(flight_t *flight) { list.record[2].command = SETROI; encode(list.bytes[2], &list.record[2]); rearm(flight); }

static void beyond_the_fence(flight_t *flight) { list.record[2].place = place_at(6200, 0); encode(list.bytes[2], &list.record[2]); rearm(flight); }

static void test_refusals(void)
{
    CHECK(refusal(nothing) == NF_OK);
    CHECK(refusal(no_fix) == NF_FIX_MISSING);
    CHECK(refusal(no_home) == NF_HOME_MISSING);
    CHECK(refusal(no_compass) == NF_NOT_READY);
    CHECK(refusal(changed) == NF_LIST_CHANGED);
    CHECK(refusal(damaged) == NF_LIST_DAMAGED);
    CHECK(refusal(empty) == NF_LIST_EMPTY);
    CHECK(refusal(low) == NF_ON_GROUND);
    CHECK(refusal(far) == NF_FIRST_FAR);
    CHECK(refusal(long_leg) == NF_LEG_LONG);
    CHECK(refusal(high) == NF_TOO_HIGH);
    CHECK(refusal(placeless) == NF_BAD_PLACE);
    CHECK(refusal(unknown) == NF_BAD_ORDER);
    CHECK(refusal(landing_first) == NF_BAD_ORDER);
    CHECK(refusal(late_takeoff) == NF_BAD_ORDER);
    CHECK(refusal(roi_last) == NF_BAD_ORDER);
}

/* Only an edge of the switch while armed starts a flight; a flight that was left goes on at its record. */
static void test_switch(void)
{
    static flight_t flight;
    nf_record_t record;
    list.count = 0;
    for (int i = 0; i < 5; i++) {
        record = random_record(WAYPOINT);
        record.place = place_at(i % 2 ? 3000 : -3000, 1000);
        record.height_m = 10;
        add(&record);
    }
    prepare(&flight, true);
    craft.armed = false;
    flight.in.switch_on = flight.toggled = true;
    step(&flight);
    craft.armed = true;
    craft.height = 1000;
    flight.toggled = false;
    for (int i = 0; i < 100; i++)
        step(&flight);
    CHECK(flight.out.mode == NF_PASS && flight.core.reason == NF_NOT_ARMED);
    flight.in.switch_on = false;
    step(&flight);
    switch_on(&flight);
    while (flight.core.record < 3)
        step(&flight);
    flight.in.switch_on = false;
    step(&flight);
    CHECK(flight.core.reason == NF_SWITCHED_OFF);
    switch_on(&flight);
    step(&flight);
    CHECK(flight.core.record == 3 && flight.core.state == NF_LEG);
    while (flight.core.state == NF_LEG)
        step(&flight);
    CHECK(flight.core.state == NF_DONE && flight.core.reason == NF_FLOWN);
    craft.armed = false;
    step(&flight);
    CHECK(flight.out.mode == NF_PASS && flight.core.reason == NF_DISARMED);
}

/* A wind that the craft cannot fly against ends the leg, in a hold. */
static void test_stall(void)
{
    static flight_t flight;
    nf_record_t record = random_record(WAYPOINT);
    list.count = 0;
    add(&record);
    record.place = place_at(8000, 0);
    add(&record);
    prepare(&flight, true);
    craft.height = 1000;
    switch_on(&flight);
    for (int i = 0; i < 60 * 1000 / STEP_MS; i++) {
        const double north = craft.at.n;
        step(&flight);
        craft.at.n = north; /* blown back */
        craft.v.n = craft.mislevel.n = 0;
    }
    CHECK(flight.core.state == NF_HELD && flight.core.reason == NF_STALLED && flight.out.mode == NF_HOLD);
}

/* A flight of one leg to the north, 8 s after it began. */
static void fly_north(flight_t *flight, const lies_t *lies)
{
    nf_record_t record = random_record(WAYPOINT);
    list.count = 0;
    record.seconds = 1;
    add(&record);
    record.place = place_at(8000, 0);
    record.height_m = 10;
    add(&record);
    prepare_with(flight, true, lies);
    craft.height = 1000;
    craft.at = craft.wind = (vector_t){0, 0};
    for (int i = 0; i < HISTORY; i++)
        step(flight);
    switch_on(flight);
    for (int i = 0; i < 8000 / STEP_MS; i++)
        step(flight);
    CHECK(flight->core.state == NF_LEG);
}

static void go_on(flight_t *flight, int seconds)
{
    for (int i = 0; i < seconds * 1000 / STEP_MS && craft.armed; i++)
        step(flight);
}

/* A place that jumps for a moment has no effect; one that goes on ends the leg in a hold where the craft is. */
static void test_jump(void)
{
    static flight_t flight;
    lies_t lies = honest;
    fly_north(&flight, &lies);
    craft.lies.jump_cm = 3000;
    go_on(&flight, 1);
    CHECK(flight.core.jumping && flight.core.state == NF_LEG);
    craft.lies.jump_cm = 0;
    go_on(&flight, 1);
    CHECK(!flight.core.jumping && flight.core.state == NF_LEG);
    craft.lies.jump_cm = -3000;
    go_on(&flight, 1);
    const double begun = craft.at.n;
    go_on(&flight, 20);
    CHECK(flight.core.state == NF_HELD && flight.core.reason == NF_JUMP);
    CHECK(craft.at.n > begun && craft.at.n < begun + 1000);
}

/* Blown out of the cylinder, or lifted out of it: held. */
static void test_fence(void)
{
    static flight_t flight;
    settings.fence_m = 90;
    fly_north(&flight, &honest);
    craft.at.e = 9000; /* farther than any wind takes it in a moment, so the fix has jumped, too */
    craft.lies.jump_s = 1e9;
    go_on(&flight, 5);
    CHECK(flight.core.state == NF_HELD && flight.core.reason == NF_JUMP);
    settings.height_m = 20;
    fly_north(&flight, &honest);
    craft.height = 3200;
    step(&flight);
    CHECK(flight.core.state == NF_HELD && flight.core.reason == NF_FENCE);
    settings.height_m = 100;
    settings.fence_m = 60;
    CHECK(refusal(beyond_the_fence) == NF_FENCE);
    settings.fence_m = 0;
}

/* A low battery ends the mission if the pilot has set it: at home, or where the craft is. The pilot's stick has priority. */
static void test_battery(void)
{
    static flight_t flight;
    settings.battery = NF_BATTERY_TOLD;
    fly_north(&flight, &honest);
    flight.in.battery_low = true;
    go_on(&flight, 6);
    CHECK(flight.core.state == NF_LEG && flight.core.battery_low);
    settings.battery = NF_BATTERY_LANDS;
    fly_north(&flight, &honest);
    flight.in.battery_low = true;
    go_on(&flight, 4);
    CHECK(flight.core.state == NF_LEG);
    go_on(&flight, 2);
    CHECK(flight.core.state == NF_SINK && flight.core.reason == NF_BATTERY);
    settings.battery = NF_BATTERY_HOME;
    fly_north(&flight, &honest);
    flight.in.battery_low = true;
    go_on(&flight, 6);
    CHECK(flight.core.state == NF_HOME && flight.core.reason == NF_BATTERY);
    flight.in.battery_low = false; /* with less load */
    go_on(&flight, 90);
    CHECK(!craft.armed && hypot(craft.at.n, craft.at.e) < 500);
    fly_north(&flight, &honest);
    flight.in.battery_low = true;
    go_on(&flight, 6);
    flight.in.stick = true;
    step(&flight);
    flight.in.stick = false;
    go_on(&flight, 10);
    CHECK(flight.core.state == NF_HELD && flight.core.reason == NF_STICKS);
    flight.in.switch_on = false;
    step(&flight);
    flight.in.switch_on = flight.toggled = true;
    step(&flight);
    CHECK(flight.core.state == NF_OFF && flight.core.reason == NF_BATTERY);
    settings.battery = NF_BATTERY_TOLD;
}

/* A craft of 0.5 kg in a wind that it stands with a lean of 22 degrees, 2.5 m above the ground in a landing. */
static void begin_landing(flight_t *flight)
{
    nf_record_t record = random_record(WAYPOINT);
    lies_t lies = honest;
    lies.mass = 0.5;
    lies.level = 0;
    list.count = 0;
    add(&record);
    record.place = place_at(0, 0);
    record.height_m = 6;
    add(&record);
    record.command = LAND;
    add(&record);
    prepare_with(flight, true, &lies);
    craft.height = 600;
    craft.at = (vector_t){0, 0};
    craft.wind = (vector_t){800, 0};
    go_on(flight, 1);
    switch_on(flight);
    while (craft.height > 250) {
        craft.gust = (vector_t){0, 0};
        step(flight);
    }
    CHECK(flight->core.state == NF_DESCENT && flight->out.mode == NF_LAND);
}

/* A gust makes a landing wait until the craft is slow over the ground again. */
static void test_landing_in_a_gust(void)
{
    static flight_t flight;
    bool has_waited = false;
    double speed = 0, lean = 0;
    begin_landing(&flight);
    for (int i = 0; i < 60000 / STEP_MS && craft.armed; i++) {
        craft.gust = (vector_t){i < 5000 / STEP_MS ? 600 : 0, 0};
        if (craft.height > 0) {
            speed = hypot(craft.v.n, craft.v.e);
            lean = lean_of_craft();
        }
        step(&flight);
        has_waited = has_waited || flight.core.waits;
    }
    CHECK(speed < 150 && lean < 31);
    CHECK(!craft.armed && has_waited);
}

/* A landing that waits ends on the ground all the same: without a fix, with a low battery, and in the end with both. */
static void test_landing_ends(void)
{
    static flight_t flight;
    for (int what = 0; what < 3; what++) {
        begin_landing(&flight);
        double waited_s = 0;
        for (int i = 0; i < 200 * 1000 / STEP_MS && craft.armed; i++) {
            craft.at = craft.gust = craft.mislevel = (vector_t){0, 0};
            craft.v = (vector_t){200, 0}; /* for good */
            step(&flight);
            if (flight.core.waits)
                waited_s += STEP_MS / 1000.0;
            if (waited_s > 3 && what == 1)
                flight.in.fix = false;
            if (waited_s > 3 && what == 2)
                flight.in.battery_low = true;
        }
        CHECK(!craft.armed && waited_s > 3);
        CHECK(what ? waited_s < 4 : waited_s < 120);
    }
}

/* The farthest from a place in the last half minute of two, m, or the fastest, m/s: steady wind, a compass that is off and not corrected. */
static double stays_within(double mass, double lag_s, double compass, bool firm, st_mode_t mode)
{
    st_t steer;
    nf_output_t out;
    lies_t lies = honest;
    double farthest = 0;
    flown = NULL; /* only the steering */
    lies.mass = mass;
    lies.lag_s = lag_s;
    lies.compass = compass;
    reset_craft(true, &lies);
    craft.at.n = craft.at.e = 0;
    craft.height = 1000;
    memset(&out, 0, sizeof out);
    out.mode = NF_GO;
    st_start(&steer, 0);
    const nf_place_t place = place_at(300, 0);
    for (uint32_t now_ms = STEP_MS; now_ms < 120000; now_ms += STEP_MS) {
        int32_t bearing;
        const double way = nf_distance(&craft.measured, &place, &bearing);
        const vector_t felt = turned(craft.felt, compass);
        const st_sense_t sense = {now_ms, {(float)felt.n, (float)felt.e}, {(float)craft.measured_v.n, (float)craft.measured_v.e},
                                  craft.new_fix, true, false};
        const st_order_t order = {mode, {(float)(way * cos(bearing / RADIAN_CD)), (float)(way * sin(bearing / RADIAN_CD))},
                                  CRUISE_CM_S, LEAN_CD};
        craft.felt = (vector_t){0, 0};
        st_sense(&steer, &sense);
        steer.compass_known = firm;
        out.lean_cd = st_steer(&steer, &order);
        out.steer = ST_STAY;
        move_craft(&out);
        craft.gust = (vector_t){0, 0};
        measure(&out);
        if (now_ms > 90000)
            farthest = fmax(farthest, (mode == ST_STAY ? hypot(craft.at.n - 300, craft.at.e) : hypot(craft.v.n, craft.v.e)) / 100);
    }
    return farthest;
}

/* The steering alone holds a place and stops, with a compass that is off by so many degrees to either side. */
static bool is_stable(double mass, double lag_s, int degrees, bool firm)
{
    for (int side = -1; side <= 1; side += 2)
        if (stays_within(mass, lag_s, side * degrees, firm, ST_STAY) >= 12 || stays_within(mass, lag_s, side * degrees, firm, ST_STOP) >= 2)
            return false;
    return true;
}

/* What naze_steer.h promises. */
static void test_margin(void)
{
    for (int mass = 1; mass <= 4; mass *= 2)
        for (int lag = 2; lag <= 5; lag += 3) {
            CHECK(is_stable(mass / 2.0, lag / 10.0, 45, false));
            CHECK(is_stable(mass / 2.0, lag / 10.0, 30, true));
        }
    CHECK(!is_stable(1, 0.2, 120, true)); /* the test can fail */
}

static int margin(double mass, double lag_s, bool firm)
{
    int degrees = 0;
    while (degrees < 90 && is_stable(mass, lag_s, degrees + 1, firm))
        degrees++;
    return degrees;
}

static void print_margins(void)
{
    printf("greatest compass error that is stable, degrees\n    kg   lag  careful  firm\n");
    for (int mass = 1; mass <= 4; mass *= 2)
        for (int lag = 2; lag <= 6; lag++)
            printf("  %4.1f  %.1f s  %7d  %4d\n", mass / 2.0, lag / 10.0, margin(mass / 2.0, lag / 10.0, false), margin(mass / 2.0, lag / 10.0, true));
}

/* The way to a standstill from 8 m/s over ground, m: the hold of a flight that is switched on there, and then left alone. */
static double stops_within(double mass, double wind_cm_s, double *farthest)
{
    static flight_t flight;
    lies_t lies = honest;
    nf_record_t record = random_record(WAYPOINT);
    lies.mass = mass;
    list.count = 0;
    add(&record);
    prepare_with(&flight, true, &lies); /* the list is refused, so it holds */
    craft.height = 1000;
    craft.wind = (vector_t){wind_cm_s, 0};
    craft.at = (vector_t){0, 0};
    for (int i = 0; i < 100; i++) {
        craft.v = (vector_t){800, 0};
        craft.lean = craft.mislevel = craft.felt = (vector_t){0, 0};
        step(&flight);
    }
    const double begun = craft.at.n;
    switch_on(&flight);
    for (int i = 0; i < 400 && !(flight.core.holding && st_speed(&flight.core.steer) < 60); i++) {
        craft.gust = (vector_t){0, 0};
        step(&flight);
    }
    CHECK(flight.core.state == NF_HELD && flight.core.holding);
    const double stood = craft.at.n;
    *farthest = 0;
    for (int i = 0; i < 500; i++) {
        step(&flight);
        *farthest = fmax(*farthest, fabs(craft.at.n - stood) / 100);
    }
    return (stood - begun) / 100;
}

static void test_braking(void)
{
    double farthest;
    for (int mass = 1; mass <= 4; mass *= 2)
        for (int wind = 0; wind <= 800; wind += 400) {
            CHECK(stops_within(mass / 2.0, wind, &farthest) < 10);
            CHECK(farthest < 4);
        }
}

/* How far a take-off in this wind drifts, the mean of ten, m. It is steered from 0.3 m on, and has to find the wind. */
static double takeoff_drift(double mass, double wind_cm_s)
{
    double drifts = 0;
    for (int i = 0; i < 10; i++) {
        static flight_t flight;
        lies_t lies = honest;
        nf_record_t record = random_record(TAKEOFF);
        double farthest = 0;
        lies.mass = mass;
        list.count = 0;
        record.height_m = 10;
        add(&record);
        add(&record);
        record.command = LOITER_UNLIM;
        record.place = place_at(0, 0);
        add(&record);
        prepare_with(&flight, false, &lies);
        craft.wind = (vector_t){wind_cm_s, 0};
        craft.at = (vector_t){0, 0};
        go_on(&flight, 1);
        switch_on(&flight);
        for (int k = 0; k < 12000 / STEP_MS; k++) {
            step(&flight);
            farthest = fmax(farthest, hypot(craft.at.n, craft.at.e) / 100);
        }
        CHECK(craft.height > 500);
        drifts += farthest;
    }
    return drifts / 10;
}

static void test_takeoff_drift(void)
{
    CHECK(takeoff_drift(1, 500) < 3);
    CHECK(takeoff_drift(1, 800) < 4);
    CHECK(takeoff_drift(0.5, 800) < 8);
}

/* Print the table of states, for the test that compares the manual. */
static void print_states(void)
{
    static const char *const modes[] = {"pass", "ground", "takeoff", "go", "hold", "level", "land"};
    static const char *const rules[] = {"none", "fixed", "climb", "metre", "turn", "record", "fix"};
    for (int i = 0; i < NF_STATES; i++)
        printf("%s|%s|%s|%lu|%s|%d\n", nf_states[i].name, modes[nf_states[i].mode], rules[nf_states[i].rule],
               (unsigned long)nf_states[i].base_ms / 1000, nf_states[nf_states[i].then].name, (int)nf_states[i].reason);
}

int main(int argc, char **argv)
{
    if (argc > 1 && !strcmp(argv[1], "--states")) {
        print_states();
        return 0;
    }
    chance_state = 88172645463325252u;
    if (argc > 1 && !strcmp(argv[1], "--margin")) {
        print_margins();
        return 0;
    }
    const unsigned long lists = argc > 1 ? strtoul(argv[1], NULL, 10) : 2000;
    const unsigned long first = argc > 2 ? strtoul(argv[2], NULL, 10) : 1;
    test_refusals();
    test_switch();
    test_stall();
    test_jump();
    test_fence();
    test_battery();
    test_landing_in_a_gust();
    test_landing_ends();
    test_margin();
    test_braking();
    test_takeoff_drift();
    for (seed = first; seed < first + lists; seed++) {
        chance_state = seed * 0x9E3779B97F4A7C15u + 1;
        if (seed % 4)
            fly_disturbed();
        else
            fly_undisturbed();
    }
    if (lists >= 1000) {
        for (int i = 0; i < NF_STATES; i++)
            if (i != NF_SINK && i != NF_NEXT)
                CHECK(seen_states[i]);
    }
    printf("%lu lists flown, %lu checks passed\n", lists, checks);
    return 0;
}
