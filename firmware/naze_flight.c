/* SPDX-License-Identifier: GPL-3.0-or-later */
/* See naze_flight.h, which is the manual. */
#include "naze_flight.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

enum { WAYPOINT, LOITER_UNLIM, LOITER_TURNS, LOITER_TIME, RETURN_TO_LAUNCH, LAND, TAKEOFF, SETROI, COMMANDS };

enum {
    CLOSE_CM = 1000,       /* nearer than this, an approach may be slow */
    NEAR_CM = 300,         /* nearer to a place than this, the bearing to it is noise: the nose stays */
    LIFTED_CM = 30,        /* off the ground */
    CLIMBED_CM = 50,       /* a climb's end: below the height by this */
    DEAD_ZONE_CM = 40,     /* a height is corrected if it is off by more, ... */
    LEVEL_CM = 20,         /* ... until it is off by less */
    SLOWEST_CM_S = 15,     /* climb rate near the height */
    TURNED_CD = 300,       /* a turn's end: short of it by this, */
    ABOUT_TURNED_CD = 900, /* ... or by this for TURNED_MS */
    TURNED_MS = 2000,
    STANDS_CM_S = 60,      /* a craft that brakes has come to a stop */
    SETTLED_CM_S = 50,
    HASTY_CM_S = 150,      /* a landing that is faster over the ground waits, ... */
    LOWEST_WAIT_CM = 100,  /* ... but not below this, ... */
    WAIT_MS = 15000,       /* ... nor for longer */
    GROWS_CM = 50,         /* the distance grows: by this ... */
    JUMP_CM = 600,         /* a fix this far, and half a second's flight, from where the craft can be has jumped */
    GROWS_MS = 1000,       /* ... within this time */
    WINDOW_MS = 4000,
    WINDOWS = NF_SLOW_MS / WINDOW_MS
};

#define PI_F 3.14159265f
#define CM_PER_UNIT 1.113195f /* one 1e-7 degree of latitude, as the firmware takes it */

const nf_row_t nf_states[NF_STATES] = {
    [NF_OFF] = {"off", NF_PASS, NF_FOREVER, 0, NF_OFF, NF_OK},
    [NF_CHECK] = {"check", NF_HOLD, NF_FIXED, 5000, NF_HELD, NF_LIST_DAMAGED},
    [NF_NEXT] = {"next", NF_GO, NF_FIXED, 5000, NF_HELD, NF_LIST_DAMAGED},
    [NF_WAIT] = {"wait", NF_GROUND, NF_FIXED, 30000, NF_HELD, NF_THROTTLE_LOW},
    [NF_LIFT] = {"lift", NF_TAKEOFF, NF_FIXED, 15000, NF_HELD, NF_NO_LIFT},
    [NF_RISE] = {"rise", NF_TAKEOFF, NF_PER_CLIMB, 10000, NF_HELD, NF_CLIMB_SLOW},
    [NF_CLIMB] = {"climb", NF_HOLD, NF_PER_CLIMB, 5000, NF_HELD, NF_CLIMB_SLOW},
    [NF_LEG] = {"leg", NF_GO, NF_PER_METRE, 60000, NF_HELD, NF_STALLED},
    [NF_LOITER] = {"loiter", NF_GO, NF_PER_RECORD, 0, NF_NEXT, NF_OK},
    [NF_TURN] = {"turn", NF_GO, NF_PER_TURN, 20000, NF_HELD, NF_TURN_SLOW},
    [NF_STAY] = {"stay", NF_GO, NF_FOREVER, 0, NF_STAY, NF_OK},
    [NF_SETTLE] = {"settle", NF_GO, NF_FIXED, 15000, NF_DESCENT, NF_OK},
    [NF_DESCENT] = {"descent", NF_LAND, NF_PER_CLIMB, 60000, NF_SINK, NF_LAND_SLOW},
    [NF_SINK] = {"sink", NF_LAND, NF_FOREVER, 0, NF_SINK, NF_OK},
    [NF_DONE] = {"done", NF_GO, NF_FOREVER, 0, NF_DONE, NF_OK},
    [NF_HELD] = {"held", NF_HOLD, NF_FOREVER, 0, NF_HELD, NF_OK},
    [NF_NO_FIX] = {"no fix", NF_LEVEL, NF_NO_FIX_TIME, 0, NF_SINK, NF_BLIND},
    [NF_HOME] = {"home", NF_GO, NF_PER_METRE, 60000, NF_SETTLE, NF_OK},
};

/* ---- numbers ---------------------------------------------------------------------------------------------------------- */

static int32_t magnitude(int32_t value)
{
    return value < 0 ? -value : value;
}

static int32_t within(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : value;
}

/* An angle as -18000..17999. */
static int32_t wrapped(int32_t angle_cd)
{
    angle_cd = (angle_cd + 18000) % 36000;
    return angle_cd < 0 ? angle_cd + 18000 : angle_cd - 18000;
}

static int32_t as_bearing(int32_t angle_cd)
{
    angle_cd = wrapped(angle_cd);
    return angle_cd < 0 ? angle_cd + 36000 : angle_cd;
}

uint32_t nf_distance(const nf_place_t *from, const nf_place_t *to, int32_t *bearing_cd)
{
    const float latitude = (float)to->lat * (PI_F / 180.0f * 1e-7f);
    const float north = (float)((int64_t)to->lat - from->lat) * CM_PER_UNIT;
    const float east = (float)((int64_t)to->lon - from->lon) * CM_PER_UNIT * cosf(latitude);
    if (bearing_cd)
        *bearing_cd = north != 0.0f || east != 0.0f ? as_bearing((int32_t)(atan2f(east, north) * (18000.0f / PI_F))) : 0;
    return (uint32_t)sqrtf(north * north + east * east);
}

/* ---- records ---------------------------------------------------------------------------------------------------------- */

static bool has_place(const nf_place_t *place)
{
    return place->lat != 0 && place->lon != 0 && magnitude(place->lat / 2) <= 450000000 &&
           magnitude(place->lon / 2) <= 900000000;
}

static void decode(nf_record_t *record, const uint8_t *bytes)
{
    record->place.lat = (int32_t)ns_get32(bytes);
    record->place.lon = (int32_t)ns_get32(bytes + 4);
    record->height_m = (int16_t)ns_get16(bytes + 8);
    record->roi = ns_get16(bytes + 10) == 1;
    record->seconds = bytes[12];
    record->radius_m = bytes[13];
    record->turns = (int8_t)bytes[14];
    record->command = bytes[15];
    if (record->turns < -127)
        record->turns = -127;
    if (record->command == TAKEOFF)
        record->height_m = (int16_t)within(record->height_m, NF_TAKEOFF_LEAST_M, NF_TAKEOFF_MOST_M);
    else if (record->height_m < NF_TAKEOFF_LEAST_M)
        record->height_m = NF_TAKEOFF_LEAST_M;
}

static bool read_record(const nf_t *f, uint16_t number, nf_record_t *record)
{
    uint8_t bytes[NM_RECORD_SIZE];
    if (number >= f->list.count || !f->read(f->self, number, bytes))
        return false;
    decode(record, bytes);
    return true;
}

/* True if the record names the place that it is flown to. */
static bool names_place(uint8_t command)
{
    return command <= LOITER_TIME || command == SETROI;
}

static bool order_is_right(const nf_t *f, uint16_t number, uint8_t command)
{
    const bool last = number + 1u == f->list.count;
    switch (command) {
    case LOITER_UNLIM:
        return last;
    case LAND:
        return last && number > 1;
    case TAKEOFF:
        return number == 1 && !last;
    case SETROI:
        return !last;
    case RETURN_TO_LAUNCH:
        return f->list.count > 2;
    default:
        return command < COMMANDS;
    }
}

/* ---- changes of state ------------------------------------------------------------------------------------------------- */

static uint32_t allowance(const nf_t *f, const nf_row_t *row)
{
    uint32_t more = 0;
    if (row->rule == NF_PER_CLIMB) {
        const uint32_t rate = f->state == NF_CLIMB     ? f->settings.climb_cm_s
                              : f->state == NF_DESCENT ? f->settings.landing_cm_s
                                                       : f->settings.launch_cm_s;
        more = 4000u * (uint32_t)magnitude(f->height_error_cm) / (rate ? rate : 1u);
    } else if (row->rule == NF_PER_METRE)
        more = f->distance_cm * (1000u / NF_SLOW_CM_S);
    else if (row->rule == NF_PER_TURN)
        more = (uint32_t)magnitude(f->now.turns) * 72000u;
    else if (row->rule == NF_PER_RECORD)
        more = f->now.seconds * 1000u;
    else if (row->rule == NF_NO_FIX_TIME)
        more = f->settings.fix_s * 1000u;
    return row->base_ms + more;
}

static void enter(nf_t *f, const nf_input_t *in, nf_state_t state)
{
    f->state = state;
    f->entered_ms = f->mark_ms = in->now_ms;
    f->mark_cm = f->distance_cm;
    f->slow = 0;
    f->waits = false;
    f->near_turn_ms = in->now_ms;
    f->allowed_ms = allowance(f, &nf_states[state]);
}

/* The place to fly to, or to stay at, is new: the guard starts again. */
static void set_target(nf_t *f, const nf_input_t *in, const nf_place_t *place)
{
    f->target = *place;
    f->holding = true;
    f->distance_cm = nf_distance(&in->place, &f->target, &f->bearing_cd);
    f->nearest_cm = f->far_cm = f->distance_cm;
    f->nearer_ms = f->grown_ms = f->calm_ms = in->now_ms;
}

/* Brake, and then stay. */
static void brake(nf_t *f, const nf_input_t *in)
{
    f->holding = false;
    f->braking_ms = f->nearer_ms = f->calm_ms = in->now_ms;
}

static void stop(nf_t *f, const nf_input_t *in, nf_reason_t reason)
{
    enter(f, in, in->fix || !in->flying || f->grounded ? NF_HELD : NF_NO_FIX);
    f->reason = reason;
    f->height_error_cm = 0;
    f->unsteered = false;
    brake(f, in);
}

/* Land where the craft is. */
static void land(nf_t *f, const nf_input_t *in, nf_reason_t reason)
{
    f->reason = reason;
    f->height_error_cm = -in->height_cm;
    brake(f, in);
    enter(f, in, NF_SINK);
}

static void end(nf_t *f, const nf_input_t *in, nf_reason_t reason)
{
    enter(f, in, NF_OFF);
    f->reason = reason;
    f->grounded = false;
    f->distance_cm = 0;
    f->height_error_cm = 0;
}

static void set_height(nf_t *f, const nf_input_t *in, int32_t height_cm)
{
    f->height_cm = height_cm;
    f->height_error_cm = height_cm - in->height_cm;
    f->adjusting = true;
}

/* Fly to the place of the record in flight. */
static void begin_leg(nf_t *f, const nf_input_t *in, const nf_place_t *place)
{
    set_target(f, in, place);
    f->nose_is_pilots = false;
    enter(f, in, NF_LEG);
}

/* Land here: at the last place if it was reached, so that the craft goes on holding it; else where the craft is now. */
static void begin_landing(nf_t *f, const nf_input_t *in)
{
    if (nf_distance(&in->place, &f->target, NULL) > f->settings.radius_cm)
        brake(f, in);
    enter(f, in, NF_SETTLE);
}

static void next_record(nf_t *f, const nf_input_t *in);

/* The mission's TAKEOFF, engaged in the air, leads to the mission's home point at the present height. */
static void leave_climb(nf_t *f, const nf_input_t *in)
{
    nf_record_t home;
    f->reached = f->record;
    if (!read_record(f, 0, &home) || !has_place(&home.place)) {
        next_record(f, in);
        return;
    }
    set_height(f, in, in->height_cm > f->now.height_m * 100 ? in->height_cm : f->now.height_m * 100);
    begin_leg(f, in, &home.place);
}

static void begin_takeoff(nf_t *f, const nf_input_t *in)
{
    if (!in->flying) {
        set_target(f, in, &in->place);
        f->grounded = true;
        enter(f, in, NF_WAIT);
    } else if (in->height_cm < f->now.height_m * 100 - CLIMBED_CM) {
        set_height(f, in, f->now.height_m * 100);
        brake(f, in);
        enter(f, in, NF_CLIMB);
    } else
        leave_climb(f, in);
}

/* Remember the regions of interest from f->record on. False if the step's reads are used up. */
static bool pass_regions(nf_t *f)
{
    unsigned reads;
    for (reads = 0; reads < NF_READS_PER_STEP; reads++) {
        if (!read_record(f, f->record, &f->now) || f->now.command != SETROI)
            return true;
        f->roi = f->now.place;
        f->roi_known = true;
        f->reached = f->record++;
    }
    return false;
}

/* Begin the record f->record. */
static void begin_record(nf_t *f, const nf_input_t *in)
{
    if (!pass_regions(f))
        return; /* and remain in NF_NEXT */
    if (f->record >= f->list.count) {
        f->record = (uint16_t)(f->list.count - 1u);
        f->begun = false;
        f->reason = NF_FLOWN;
        enter(f, in, NF_DONE);
        return;
    }
    if (!read_record(f, f->record, &f->now)) {
        stop(f, in, NF_LIST_DAMAGED);
        return;
    }
    f->begun = true;
    switch (f->now.command) {
    case TAKEOFF:
        begin_takeoff(f, in);
        break;
    case LAND:
        begin_landing(f, in);
        break;
    default:
        set_height(f, in, f->now.height_m * 100);
        begin_leg(f, in, f->now.command == RETURN_TO_LAUNCH ? &in->home : &f->now.place);
        break;
    }
}

static void next_record(nf_t *f, const nf_input_t *in)
{
    f->record++;
    enter(f, in, NF_NEXT);
    begin_record(f, in);
}

/* ---- start ------------------------------------------------------------------------------------------------------------ */

static nf_reason_t cannot_start(const nf_t *f, const nf_input_t *in)
{
    if (!f->settings.enabled)
        return NF_DISABLED;
    if (!in->armed || !f->armed)
        return NF_NOT_ARMED;
    if (!in->fix)
        return NF_FIX_MISSING;
    if (!in->home_known)
        return NF_HOME_MISSING;
    if (in->battery_low && f->settings.battery != NF_BATTERY_TOLD)
        return NF_BATTERY;
    return in->instruments ? NF_OK : NF_NOT_READY;
}

static void start(nf_t *f, const nf_input_t *in)
{
    const nf_reason_t reason = cannot_start(f, in);
    if (reason != NF_OK) {
        end(f, in, reason);
        return;
    }
    f->reason = NF_OK;
    f->used = true;
    f->battery_acts = false;
    f->unsteered = false;
    st_begin(&f->steer, in->lean_cd);
    brake(f, in);
    f->throttle_works = false;
    f->nose_is_pilots = true; /* until a leg begins */
    f->nose_cd = as_bearing(in->heading_cd);
    f->roi_known = false;
    f->distance_cm = 0;
    f->height_error_cm = 0;
    f->count = f->list.count;
    f->checksum = 0;
    f->next = 0;
    f->last = f->target = in->place;
    f->first = !f->begun;
    if (!f->begun) {
        f->record = 1;
        f->reached = NF_NO_RECORD;
    }
    enter(f, in, NF_CHECK);
    if (in->list.count != f->list.count || in->list.checksum != f->list.checksum)
        stop(f, in, NF_LIST_CHANGED);
    else if (f->list.count < 2)
        stop(f, in, NF_LIST_EMPTY);
}

/* Farther from home than the cylinder's radius and a margin. */
static bool is_outside(const nf_t *f, const nf_input_t *in, const nf_place_t *place, uint32_t margin_m)
{
    return f->settings.fence_m && nf_distance(&in->home, place, NULL) / 100u > f->settings.fence_m + margin_m;
}

/* The place that a record leads to from f->last is within its limits. */
static nf_reason_t check_distance(nf_t *f, const nf_input_t *in, const nf_place_t *place)
{
    const bool first = f->first;
    const uint32_t distance_m = nf_distance(&f->last, place, NULL) / 100u;
    f->last = *place;
    f->first = false;
    if (is_outside(f, in, place, 0))
        return NF_FENCE;
    if (distance_m > NF_MAX_LEG_M)
        return NF_LEG_LONG;
    return first && distance_m > f->settings.first_m ? NF_FIRST_FAR : NF_OK;
}

static nf_reason_t check_record(nf_t *f, const nf_input_t *in, uint16_t number, const nf_record_t *record)
{
    nf_record_t home;
    if (!order_is_right(f, number, record->command))
        return NF_BAD_ORDER;
    if (names_place(record->command) && !has_place(&record->place))
        return NF_BAD_PLACE;
    if (record->command != LAND && record->command != SETROI && magnitude(record->height_m) > f->settings.height_m)
        return NF_TOO_HIGH;
    if (number < f->record) {
        if (record->command == SETROI) {
            f->roi = record->place;
            f->roi_known = true;
        }
        return NF_OK;
    }
    if (number == f->record && (in->flying ? in->height_cm < NF_MIN_HEIGHT_CM : record->command != TAKEOFF))
        return NF_ON_GROUND;
    switch (record->command) {
    case SETROI:
    case LAND:
        return NF_OK;
    case RETURN_TO_LAUNCH:
        return check_distance(f, in, &in->home);
    case TAKEOFF: /* airborne it leads to the mission's home point */
        return in->flying && read_record(f, 0, &home) && has_place(&home.place) ? check_distance(f, in, &home.place)
                                                                                : NF_OK;
    default:
        return check_distance(f, in, &record->place);
    }
}

static void check(nf_t *f, const nf_input_t *in)
{
    uint8_t bytes[NM_RECORD_SIZE];
    nf_record_t record;
    unsigned reads;
    for (reads = 0; reads < NF_READS_PER_STEP && f->next < f->list.count; reads++, f->next++) {
        nf_reason_t reason = NF_LIST_DAMAGED;
        if (f->read(f->self, f->next, bytes)) {
            f->checksum = nm_crc32(f->checksum, bytes, NM_RECORD_SIZE);
            decode(&record, bytes);
            reason = f->next ? check_record(f, in, f->next, &record) : NF_OK;
        }
        if (reason != NF_OK) {
            if (!f->begun)
                f->record = f->next;
            stop(f, in, reason);
            return;
        }
    }
    if (f->next < f->list.count)
        return;
    if (f->checksum != f->list.checksum)
        stop(f, in, NF_LIST_DAMAGED);
    else {
        enter(f, in, NF_NEXT);
        begin_record(f, in);
    }
}

/* ---- flight ----------------------------------------------------------------------------------------------------------- */

static uint32_t radius_of(const nf_t *f)
{
    const uint32_t radius_cm = f->now.command <= LOITER_TIME ? f->now.radius_m * 100u : 0u;
    return radius_cm > f->settings.radius_cm ? radius_cm : f->settings.radius_cm;
}

static void reach_place(nf_t *f, const nf_input_t *in)
{
    f->reached = f->record;
    switch (f->now.command) {
    case LOITER_UNLIM:
        enter(f, in, NF_STAY);
        break;
    case LOITER_TURNS:
        f->to_turn_cd = f->now.turns * 36000;
        enter(f, in, NF_TURN);
        break;
    case LOITER_TIME:
        enter(f, in, NF_LOITER);
        break;
    default:
        next_record(f, in);
        break;
    }
}

static void fly_leg(nf_t *f, const nf_input_t *in)
{
    if (f->distance_cm <= radius_of(f)) {
        reach_place(f, in);
        return;
    }
    if (in->now_ms - f->mark_ms < WINDOW_MS)
        return;
    f->slow = f->distance_cm < CLOSE_CM || f->mark_cm >= f->distance_cm + NF_SLOW_CM_S * WINDOW_MS / 1000 ? 0 : (uint8_t)(f->slow + 1);
    f->mark_ms = in->now_ms;
    f->mark_cm = f->distance_cm;
    if (f->slow >= WINDOWS)
        stop(f, in, NF_STALLED);
}

static void turn(nf_t *f, const nf_input_t *in)
{
    f->to_turn_cd -= wrapped(in->heading_cd - f->heading_cd) - f->corrected_cd;
    if (magnitude(f->to_turn_cd) > ABOUT_TURNED_CD)
        f->near_turn_ms = in->now_ms;
    if (magnitude(f->to_turn_cd) <= TURNED_CD || in->now_ms - f->near_turn_ms >= TURNED_MS)
        next_record(f, in);
}

/* The throttle stick has left its middle zone. */
static void use_throttle(nf_t *f, const nf_input_t *in)
{
    switch (f->state) {
    case NF_LIFT:
    case NF_RISE:
    case NF_CLIMB:
    case NF_SETTLE:
    case NF_DESCENT:
    case NF_SINK:
        stop(f, in, NF_THROTTLE);
        break;
    default:
        f->height_cm = in->height_cm;
        f->adjusting = false;
        break;
    }
}

static bool lands(const nf_t *f)
{
    return f->state == NF_DESCENT || f->state == NF_SINK;
}

static bool has_settled(const nf_t *f)
{
    return f->holding && st_speed(&f->steer) < (float)SETTLED_CM_S && f->distance_cm <= f->settings.radius_cm;
}

/* A gust must not carry the craft along the ground: the descent goes on when it has settled again. */
static bool must_wait(const nf_t *f, const nf_input_t *in)
{
    if (!in->fix || in->battery_low || f->unsteered)
        return false;
    if (f->waits)
        return !has_settled(f) && in->now_ms - f->mark_ms < WAIT_MS;
    return in->height_cm > LOWEST_WAIT_CM && st_speed(&f->steer) > (float)HASTY_CM_S;
}

/* On the way home, or landing there, for failsafe, return-to-launch or the battery. */
static bool homing(const nf_t *f)
{
    return f->state != NF_HELD && (f->reason == NF_FAILSAFE || f->reason == NF_RTL || f->reason == NF_BATTERY);
}

/* What calls the craft home. A pilot who has taken it over decides about a low battery. */
static nf_reason_t caller(const nf_t *f, const nf_input_t *in)
{
    if (in->failsafe)
        return NF_FAILSAFE;
    if (in->rtl)
        return NF_RTL;
    return f->battery_acts && !(f->state == NF_HELD && f->reason == NF_STICKS) ? NF_BATTERY : NF_OK;
}

/* Home, or down if that is impossible or set. True if it has changed the state. */
static bool called_home(nf_t *f, const nf_input_t *in)
{
    const nf_reason_t why = caller(f, in);
    if (why == NF_OK && homing(f) && in->fix) {
        stop(f, in, f->reason);
        return true;
    }
    if (why == NF_OK || homing(f) || lands(f) || (in->stick && !in->failsafe))
        return false;
    if (f->grounded || !in->flying) {
        end(f, in, why);
        return true;
    }
    if (!in->fix || !in->home_known || (in->failsafe && f->settings.failsafe_lands) ||
        (why == NF_BATTERY && f->settings.battery == NF_BATTERY_LANDS)) {
        land(f, in, why);
        return true;
    }
    set_height(f, in, in->height_cm > f->settings.home_m * 100 ? in->height_cm : f->settings.home_m * 100);
    f->climbs_first = f->height_error_cm > CLIMBED_CM;
    f->nose_is_pilots = true;
    if (f->climbs_first) {
        f->distance_cm = nf_distance(&in->place, &in->home, &f->bearing_cd);
        brake(f, in);
    } else
        set_target(f, in, &in->home);
    enter(f, in, NF_HOME);
    f->reason = why;
    return true;
}

/* The craft is too fast, or leans too much. */
static bool is_wild(nf_t *f, const nf_input_t *in)
{
    const float lean = sqrtf(in->lean_cd.n * in->lean_cd.n + in->lean_cd.e * in->lean_cd.e);
    const bool wild = lean > (float)(f->settings.lean_cd + NF_LEAN_CD) ||
                      (f->holding && st_speed(&f->steer) > (float)(f->settings.speed_cm_s + NF_FAST_CM_S));
    if (!wild)
        f->calm_ms = in->now_ms;
    return in->now_ms - f->calm_ms >= NF_WILD_MS;
}

/* The place gets farther away, or the craft does not come to a stop. */
static bool is_lost(nf_t *f, const nf_input_t *in)
{
    if (!f->holding)
        return in->now_ms - f->braking_ms >= NF_STOP_MS;
    if (f->distance_cm < f->nearest_cm)
        f->nearest_cm = f->distance_cm;
    if (f->distance_cm < f->far_cm + GROWS_CM) {
        if (f->distance_cm < f->far_cm)
            f->far_cm = f->distance_cm;
        if (in->now_ms - f->nearer_ms >= GROWS_MS) {
            f->far_cm = f->distance_cm;
            f->nearer_ms = in->now_ms;
            f->grown_ms = in->now_ms;
        }
        return f->state != NF_LEG && f->state != NF_HOME && f->distance_cm > f->nearest_cm + NF_LOST_CM;
    }
    f->far_cm = f->distance_cm;
    f->nearer_ms = in->now_ms;
    return in->now_ms - f->grown_ms >= NF_AWAY_MS && f->distance_cm > f->nearest_cm + NF_AWAY_CM;
}

/* What ends or interrupts a flight, whatever its state. True if it has changed the state. */
static bool interrupted(nf_t *f, const nf_input_t *in)
{
    const nf_state_t state = f->state;
    const bool steered = f->steering >= ST_STOP && in->fix;
    if (called_home(f, in))
        return true;
    if (!in->fix && state != NF_NO_FIX && !lands(f)) {
        if (in->flying && !f->grounded) {
            if (!homing(f))
                f->reason = NF_FIX_LOST;
            enter(f, in, NF_NO_FIX);
        } else if (state != NF_HELD)
            stop(f, in, NF_FIX_LOST);
    } else if (state == NF_NO_FIX)
        return false;
    else if (steered && is_wild(f, in) && (lands(f) || state == NF_HELD)) {
        if (state == NF_HELD)
            land(f, in, NF_HOLD_LOST);
        f->unsteered = true;
    } else if (steered && (is_wild(f, in) || is_lost(f, in))) {
        if (lands(f))
            brake(f, in);
        else if (state == NF_HOME || state == NF_HELD)
            land(f, in, state == NF_HELD ? NF_HOLD_LOST : f->reason);
        else
            stop(f, in, NF_AWAY);
    } else if (f->jumped && steered && state != NF_HOME) {
        if (lands(f) || state == NF_HELD)
            brake(f, in);
        else
            stop(f, in, NF_JUMP);
    } else if (state == NF_HELD)
        return false;
    else if (in->stick)
        stop(f, in, NF_STICKS);
    else if (homing(f))
        return false;
    else if (f->throttle_works && !in->throttle_middle)
        use_throttle(f, in);
    else if (lands(f))
        return false;
    else if (in->list.count != f->list.count || in->list.checksum != f->list.checksum)
        stop(f, in, NF_LIST_CHANGED);
    else if (is_outside(f, in, &in->place, NF_OUTSIDE_M) ||
             in->height_cm > (f->settings.height_m + NF_OUTSIDE_M) * 100)
        stop(f, in, NF_FENCE);
    else if (in->now_ms - f->compass_ms >= NF_COMPASS_MS)
        stop(f, in, NF_COMPASS);
    return f->state != state;
}

static bool too_late(nf_t *f, const nf_input_t *in)
{
    const nf_row_t *row = &nf_states[f->state];
    if (row->rule == NF_FOREVER || in->now_ms - f->entered_ms < f->allowed_ms)
        return false;
    if (row->then == NF_NEXT)
        next_record(f, in);
    else if (row->then == NF_HELD)
        stop(f, in, row->reason);
    else if (f->state == NF_NO_FIX)
        land(f, in, row->reason);
    else if (f->state == NF_HOME) { /* too slow against the wind: land here */
        brake(f, in);
        enter(f, in, NF_SETTLE);
    } else {
        if (row->reason != NF_OK)
            f->reason = row->reason;
        f->height_error_cm = -in->height_cm;
        enter(f, in, row->then);
    }
    return true;
}

static void fly(nf_t *f, const nf_input_t *in)
{
    switch (f->state) {
    case NF_CHECK:
        check(f, in);
        break;
    case NF_NEXT:
        begin_record(f, in);
        break;
    case NF_WAIT:
        f->ground_cm = in->height_cm;
        f->height_error_cm = f->now.height_m * 100;
        if (in->throttle_middle)
            enter(f, in, NF_LIFT);
        break;
    case NF_LIFT:
        if (in->flying && in->height_cm >= f->ground_cm + LIFTED_CM) {
            f->grounded = false;
            enter(f, in, NF_RISE);
        }
        break;
    case NF_RISE:
        f->height_error_cm = f->ground_cm + f->now.height_m * 100 - in->height_cm;
        if (f->height_error_cm <= CLIMBED_CM) {
            f->reached = f->record;
            next_record(f, in);
        }
        break;
    case NF_CLIMB:
        if (f->height_error_cm <= CLIMBED_CM)
            leave_climb(f, in);
        break;
    case NF_LEG:
        fly_leg(f, in);
        break;
    case NF_TURN:
        turn(f, in);
        break;
    case NF_SETTLE:
        if (has_settled(f)) {
            f->height_error_cm = -in->height_cm;
            enter(f, in, NF_DESCENT);
        }
        break;
    case NF_DESCENT:
        if (!f->waits)
            f->mark_ms = in->now_ms;
        f->waits = must_wait(f, in);
        break;
    case NF_NO_FIX:
        if (in->fix)
            stop(f, in, f->reason);
        else if (in->stick)
            f->entered_ms = in->now_ms;
        break;
    case NF_HOME:
        if (f->climbs_first && f->height_error_cm <= CLIMBED_CM) {
            f->climbs_first = false;
            set_target(f, in, &in->home);
            enter(f, in, NF_HOME);
        } else if (!f->climbs_first && f->holding && f->distance_cm <= f->settings.radius_cm)
            enter(f, in, NF_SETTLE);
        break;
    default:
        break;
    }
}

/* ---- output ----------------------------------------------------------------------------------------------------------- */

static nf_mode_t mode_of(const nf_t *f, const nf_input_t *in)
{
    const nf_mode_t mode = f->waits ? NF_HOLD : nf_states[f->state].mode;
    return mode == NF_HOLD && (!in->flying || f->grounded) ? NF_GROUND : mode;
}

/* How the craft is steered in this state. */
static st_mode_t steering(const nf_t *f, const nf_input_t *in, nf_mode_t mode)
{
    if (mode == NF_PASS || mode == NF_GROUND || f->grounded || f->unsteered)
        return ST_NONE;
    if (in->stick)
        return ST_LEAN;
    if (!in->fix || !f->holding)
        return ST_STOP;
    return f->state == NF_LEG && f->now.command == WAYPOINT && f->now.seconds == 0 ? ST_PASS : ST_STAY;
}

/* These modes have a place, f->target. */
static bool has_target(const nf_t *f)
{
    const nf_mode_t mode = nf_states[f->state].mode;
    return f->holding && (mode == NF_GO || mode == NF_TAKEOFF || mode == NF_LAND || mode == NF_HOLD);
}

/* In these states f->height_cm is flown to. */
static bool has_height(const nf_t *f)
{
    switch (f->state) {
    case NF_CLIMB:
    case NF_LEG:
    case NF_LOITER:
    case NF_TURN:
    case NF_STAY:
    case NF_DONE:
    case NF_HOME:
        return true;
    default:
        return false;
    }
}

static int16_t climb_rate(nf_t *f, const nf_input_t *in)
{
    const int32_t off_cm = f->height_error_cm - in->climb_cm_s / 3;
    const int32_t fastest = f->settings.climb_cm_s;
    int32_t rate = magnitude(f->height_error_cm) / 2;
    if (magnitude(f->height_error_cm) > DEAD_ZONE_CM)
        f->adjusting = true;
    if ((magnitude(off_cm) < LEVEL_CM) || (off_cm < 0) != (f->height_error_cm < 0))
        f->adjusting = false;
    if (!f->adjusting)
        return 0;
    if (f->state == NF_LEG && f->settings.speed_cm_s) {
        /* Over the estimated time of the leg, and a fifth more, as the firmware's author planned it. */
        const uint32_t eta_s = 1u + f->distance_cm / f->settings.speed_cm_s * 6u / 5u;
        rate = within(magnitude(f->height_error_cm) / (int32_t)eta_s, 2 * SLOWEST_CM_S, rate > 30 ? rate : 30);
    }
    rate = within(rate, SLOWEST_CM_S, fastest);
    return (int16_t)(f->height_error_cm < 0 ? -rate : rate);
}

static void point_nose(nf_t *f, const nf_input_t *in, nf_output_t *out)
{
    if (f->state == NF_TURN) {
        out->nose = !in->yaw_stick;
        out->heading_cd = as_bearing(in->heading_cd + within(f->to_turn_cd, -NF_LEAD_CD, NF_LEAD_CD));
        f->nose_cd = as_bearing(in->heading_cd + f->to_turn_cd);
        return;
    }
    if (in->yaw_stick) {
        f->nose_is_pilots = true;
        f->nose_cd = as_bearing(in->heading_cd);
    }
    if (f->nose_is_pilots)
        ;
    else if (f->now.roi && f->roi_known && f->now.command <= LOITER_TIME) {
        int32_t bearing_cd;
        if (nf_distance(&in->place, &f->roi, &bearing_cd) > NEAR_CM)
            f->nose_cd = bearing_cd;
    } else if (f->state == NF_LEG && f->distance_cm > NEAR_CM)
        f->nose_cd = f->bearing_cd;
    out->nose = !in->yaw_stick;
    out->heading_cd = as_bearing(in->heading_cd + within(wrapped(f->nose_cd - in->heading_cd), -NF_LEAD_CD, NF_LEAD_CD));
}

static void steer(nf_t *f, const nf_input_t *in, nf_output_t *out)
{
    const st_vector_t way = {(float)f->distance_cm * cosf((float)f->bearing_cd * (PI_F / 18000.0f)),
                             (float)f->distance_cm * sinf((float)f->bearing_cd * (PI_F / 18000.0f))};
    st_order_t order;
    order.mode = steering(f, in, out->mode);
    order.way = way;
    order.cruise_cm_s = f->settings.speed_cm_s;
    order.most_cd = lands(f) && !f->waits ? within(f->settings.lean_cd, 0, NF_LANDING_CD) : f->settings.lean_cd;
    f->steering = order.mode;
    if (order.mode == ST_LEAN || (order.mode == ST_STOP && !in->fix))
        brake(f, in);
    else if (order.mode == ST_STOP && st_speed(&f->steer) < (float)STANDS_CM_S)
        set_target(f, in, &in->place);
    out->steer = order.mode;
    out->lean_cd = st_steer(&f->steer, &order);
}

static void command(nf_t *f, const nf_input_t *in, nf_output_t *out)
{
    memset(out, 0, sizeof *out);
    out->mode = mode_of(f, in);
    out->pilots_throttle = f->throttle_works && (f->state == NF_HELD || out->mode == NF_LEVEL);
    if (has_height(f))
        out->climb_cm_s = climb_rate(f, in);
    if (out->mode == NF_TAKEOFF)
        out->takeoff_cm = f->now.height_m * 100;
    if (has_target(f))
        out->target = f->target;
    steer(f, in, out);
    if (out->mode == NF_GO || out->mode == NF_TAKEOFF)
        point_nose(f, in, out);
}

static void measure(nf_t *f, const nf_input_t *in)
{
    if (has_target(f))
        f->distance_cm = nf_distance(&in->place, &f->target, &f->bearing_cd);
    else
        f->distance_cm = 0;
    if (has_height(f))
        f->height_error_cm = f->height_cm - in->height_cm;
    if (f->jumped)
        f->nearest_cm = f->far_cm = f->distance_cm;
}

/* The place where the craft is by its speed since the last fix that was believed. */
static nf_place_t flown_to(const nf_t *f)
{
    nf_place_t place = f->place;
    place.lat += (int32_t)(f->flown_cm.n / CM_PER_UNIT);
    place.lon += (int32_t)(f->flown_cm.e / (CM_PER_UNIT * cosf((float)f->place.lat * (PI_F / 180.0f * 1e-7f))));
    return place;
}

/* Replace the place of a fix that has jumped. */
static void believe(nf_t *f, nf_input_t *in)
{
    nf_place_t expected;
    f->jumped = false;
    if (f->state == NF_OFF || !in->fix || !in->flying) {
        f->placed = f->jumping = false;
        return;
    }
    f->flown_cm.n += f->steer.velocity.n * 0.02f;
    f->flown_cm.e += f->steer.velocity.e * 0.02f;
    expected = flown_to(f);
    if (in->new_fix) {
        const bool jumps = f->placed && nf_distance(&expected, &in->place, NULL) > JUMP_CM + (uint32_t)st_speed(&f->steer) / 2u;
        if (jumps && !f->jumping)
            f->jump_ms = in->now_ms;
        f->jumped = jumps && f->jumping && in->now_ms - f->jump_ms >= NF_JUMP_MS;
        f->jumping = jumps && !f->jumped;
        if (!f->jumping) {
            f->place = in->place;
            f->flown_cm.n = f->flown_cm.e = 0.0f;
            f->placed = true;
        }
    }
    if (f->jumping)
        in->place = expected;
}

static nf_reason_t ending(const nf_input_t *in)
{
    if (!in->armed)
        return NF_DISARMED;
    return in->switch_on ? NF_OK : NF_SWITCHED_OFF;
}

/* Measure velocity and compass. A correction of the compass turns the heading from the next call on. */
static void sense(nf_t *f, const nf_input_t *in)
{
    st_sense_t sense;
    const int32_t before_cd = f->steer.correction_cd;
    sense.now_ms = in->now_ms;
    sense.felt = in->felt;
    sense.velocity = in->velocity;
    sense.new_fix = in->new_fix && in->fix;
    sense.flying = in->flying && in->armed;
    sense.compares = f->used;
    f->corrected_cd = f->correct_cd;
    if (!in->armed)
        st_start(&f->steer, in->now_ms);
    else
        st_sense(&f->steer, &sense);
    f->correct_cd = wrapped(f->steer.correction_cd - before_cd);
    if (magnitude(f->steer.correction_cd) <= NF_MAX_COMPASS_CD)
        f->compass_ms = in->now_ms;
}

void nf_start(nf_t *f, nf_read_t read, void *self)
{
    memset(f, 0, sizeof *f);
    f->read = read;
    f->self = self;
    f->record = f->reached = NF_NO_RECORD;
}

/* A load can lower the voltage for a moment. */
static void watch_battery(nf_t *f, const nf_input_t *in)
{
    f->battery_low = in->battery_low;
    if (!in->battery_low)
        f->charged_ms = in->now_ms;
    else if (in->now_ms - f->charged_ms >= NF_BATTERY_MS && f->settings.battery != NF_BATTERY_TOLD)
        f->battery_acts = true;
}

void nf_step(nf_t *f, const nf_settings_t *settings, nf_input_t *in, nf_output_t *out)
{
    const nf_reason_t ends = ending(in);
    const bool switched_on = in->switch_on && !f->switch_on;
    if (!in->armed) {
        f->settings = *settings;
        f->list = in->list;
        f->count = in->list.count;
        f->begun = f->used = false;
    }
    watch_battery(f, in);
    sense(f, in);
    believe(f, in);
    measure(f, in);
    if (ends != NF_OK) {
        if (f->state != NF_OFF)
            end(f, in, ends);
        if (switched_on)
            f->reason = in->armed ? ends : NF_NOT_ARMED;
    } else if (switched_on && (in->failsafe || in->rtl))
        f->reason = in->failsafe ? NF_FAILSAFE : NF_RTL;
    else if (switched_on)
        start(f, in);
    else if (f->state != NF_OFF) {
        if (in->throttle_middle)
            f->throttle_works = true;
        if (!interrupted(f, in) && !too_late(f, in))
            fly(f, in);
    }
    command(f, in, out);
    out->correction_cd = f->steer.correction_cd;
    f->armed = in->armed;
    f->switch_on = in->switch_on;
    f->heading_cd = in->heading_cd;
}
