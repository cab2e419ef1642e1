/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Experimental: flown in simulation only. First flights: propellers off, then on a tether, then with height.
 *
 * Mission flight: flies a stored mission list (naze_mission.h), as docs/mission-flight.md describes it. This header is the
 * manual of the core; the firmware around it flies.
 *
 * Once every control loop (50 Hz) the firmware passes position, velocity, height, heading, sticks and switches to nf_step()
 * and gets back one of seven modes with its details: a lean (naze_steer.h), a climb rate, a heading.
 * No heap, no I/O, no globals: the caller owns all state, one nf_t. Its only time is a millisecond counter that may wrap.
 *
 * SAFETY
 *   One switch starts a flight: the pilot's, going from off to on while armed, with fix, home, compass and barometer. Switched off, the
 *   next call commands nothing. Failsafe and return-to-launch make the flight itself fly home and land (NF_HOME); the mission
 *   goes on only after the switch was off. Nothing else starts, stops, skips or moves a flight.
 *
 *   The list is flown only if its CRC-32 is right and it is still the list that was there at arming; if all commands, places,
 *   distances and heights are within their limits. That is checked record by record before the first of them is flown.
 *   A flight that cannot go on brakes and holds its place; nf_t.reason says why. Sensors may be wrong: a state that steers
 *   ends in that hold as soon as its place gets farther away for NF_AWAY_MS, or the craft is too fast or leans too much. If
 *   the hold does not hold, the craft lands, steered no longer. A compass that is off by more than NF_MAX_COMPASS_CD is held,
 *   a smaller error is corrected.
 *
 *   Without a fix the craft keeps its height and its lean into the wind; the pilot's sticks steer. A fix that returns is held.
 *   Without a fix for `fix_s`, sticks untouched, it lands; a landing that has begun goes on without a fix. A place that the
 *   craft cannot have flown to is not believed: it flies on by its speed, and after NF_JUMP_MS holds where it is.
 *
 *   A landing waits while the craft is fast over the ground, but not without a fix, with a low battery, or for
 *   good: it always ends on the ground.
 *
 *   No mission leaves the cylinder of `fence_m` and `height_m` around home: a list that would is not flown, and a craft that
 *   is outside by NF_OUTSIDE_M is held.
 *
 *   A slot of the list can be written by any client: heights, take-off heights and turns are limited as they are read.
 *
 *   Sticks: roll or pitch gives the craft to the pilot (position hold, in the same call) until the switch was off. Yaw turns
 *   the nose, which then stays there until the next leg. The throttle works once it has been in its middle zone since the
 *   flight started: leaving that zone ends a climb or descent; during take-off, climb and landing it ends the flight (hold).
 *
 * STATES
 *   nf_states[] is the table: what each state commands, when it must be left, and what follows if it is not. docs/
 *   mission-flight.md has the same table; a test compares them.
 *
 * WORK
 *   One call reads at most NF_MAX_READS records, has no loop but that, and computes at most three distances. A list is
 *   checked over the first calls of a flight: 146 records in 19 calls.
 */
#ifndef NAZE_FLIGHT_H
#define NAZE_FLIGHT_H

#include "naze_mission.h"
#include "naze_steer.h"

#define NF_VERSION 2u
#define NF_READS_PER_STEP 8u /* records checked, and regions of interest passed */
#define NF_MAX_READS 20u
#define NF_NO_RECORD 0xFFFFu
#define NF_MAX_LEG_M 2000u  /* the longest leg that is flown */
#define NF_MIN_HEIGHT_CM 100 /* a craft whose throttle was high may still be on the ground below this */
#define NF_TAKEOFF_LEAST_M 2 /* take-off heights, and the lowest height of a leg */
#define NF_TAKEOFF_MOST_M 15
#define NF_MAX_COMPASS_CD 7500 /* a compass that is off by more for NF_COMPASS_MS is not trusted */
#define NF_COMPASS_MS 5000u
#define NF_AWAY_MS 3000u    /* a place that gets farther away for so long ... */
#define NF_AWAY_CM 1500u    /* ... and by this, or a hold by NF_LOST_CM altogether, is lost */
#define NF_LOST_CM 2000u
#define NF_FAST_CM_S 500    /* above the cruise speed by this, or ... */
#define NF_LEAN_CD 1500     /* ... leaning more than the greatest lean by this, for NF_WILD_MS: out of control */
#define NF_WILD_MS 1000u
#define NF_STOP_MS 8000u    /* the longest time to brake to a standstill */
#define NF_SLOW_CM_S 50     /* a leg that closes in more slowly ... */
#define NF_SLOW_MS 20000u   /* ... for so long is stalled */
#define NF_JUMP_MS 2000u    /* a place that jumps is not believed for so long */
#define NF_OUTSIDE_M 10     /* outside the cylinder by more is held */
#define NF_BATTERY_MS 5000u /* the battery is low: for so long */
#define NF_LANDING_CD 3000  /* greatest lean of a craft that sinks, 1/100 degree */
#define NF_LEAD_CD 4500     /* the heading asked for is at most this far from the present one, 1/100 degree */

/* A place, degrees * 1e7. */
typedef struct {
    int32_t lat;
    int32_t lon;
} nf_place_t;

/* What the firmware is to do until the next call. */
typedef enum {
    NF_PASS,     /* nothing is commanded: the pilot flies */
    NF_GROUND,   /* standing on the ground, armed: motors idle, whatever the throttle stick says */
    NF_TAKEOFF,  /* take off to `takeoff_cm` above the ground, holding the place `target` */
    NF_GO,       /* fly to `target` */
    NF_HOLD,     /* brake, and stay where the craft comes to a stop */
    NF_LEVEL,    /* no fix: lean into the wind as before, height held; the sticks steer */
    NF_LAND      /* land, then disarm */
} nf_mode_t;

typedef enum {
    NF_OFF,
    NF_CHECK,
    NF_NEXT,
    NF_WAIT,
    NF_LIFT,
    NF_RISE,
    NF_CLIMB,
    NF_LEG,
    NF_LOITER,
    NF_TURN,
    NF_STAY,
    NF_SETTLE,
    NF_DESCENT,
    NF_SINK,
    NF_DONE,
    NF_HELD,
    NF_NO_FIX,
    NF_HOME,
    NF_STATES
} nf_state_t;

/* Why a flight did not start, stopped, or is slower than it should be. */
typedef enum {
    NF_OK = 0,
    NF_DISABLED,      /* did not start: the setting mission_fly is 0 */
    NF_NOT_ARMED,     /* ... the switch was on before arming */
    NF_FIX_MISSING,   /* ... no fix, or fewer than 5 satellites */
    NF_HOME_MISSING,  /* ... no home position */
    NF_NOT_READY,     /* ... compass or barometer missing or not calibrated */
    NF_LIST_EMPTY,    /* list refused: no record after the home point */
    NF_LIST_DAMAGED,  /* ... its CRC is wrong, or a record cannot be read */
    NF_LIST_CHANGED,  /* ... another one than at arming */
    NF_BAD_ORDER,     /* ... a command that is unknown or must not be at this place of the list */
    NF_BAD_PLACE,     /* ... a place without coordinates */
    NF_FIRST_FAR,     /* ... the first place is too far away */
    NF_LEG_LONG,      /* ... a leg is longer than NF_MAX_LEG_M */
    NF_TOO_HIGH,      /* ... a height above the limit */
    NF_ON_GROUND,     /* ... on the ground, and the first record is no TAKEOFF; or flying below NF_MIN_HEIGHT_CM */
    NF_THROTTLE_LOW,  /* stopped: the throttle was not put into the middle in time */
    NF_NO_LIFT,       /* ... the craft did not leave the ground */
    NF_CLIMB_SLOW,    /* ... a climb took too long */
    NF_STALLED,       /* ... a leg came no nearer: wind */
    NF_TURN_SLOW,     /* ... the craft did not turn */
    NF_LAND_SLOW,     /* landing takes too long; it goes on */
    NF_STICKS,        /* stopped: roll or pitch stick */
    NF_THROTTLE,      /* ... throttle stick during take-off, climb or landing */
    NF_FIX_LOST,      /* ... */
    NF_RTL,           /* ended: the pilot's return-to-launch */
    NF_FAILSAFE,      /* ... */
    NF_SWITCHED_OFF,  /* ... the pilot's switch */
    NF_DISARMED,      /* ... */
    NF_FLOWN,         /* the whole list was flown */
    NF_AWAY,          /* stopped: the place got farther away, the craft too fast, or it leant too much */
    NF_COMPASS,       /* ... the compass is off by more than NF_MAX_COMPASS_CD */
    NF_HOLD_LOST,     /* landing: the hold did not hold */
    NF_BLIND,         /* landing: no fix for too long */
    NF_FENCE,         /* list refused, or stopped: outside the cylinder */
    NF_BATTERY,       /* did not start, ends or lands: the battery is low */
    NF_JUMP,          /* stopped: the GPS's place has jumped */
    NF_REASONS
} nf_reason_t;

/* How the time that a state may take is computed: `base_ms`, and in addition ... */
typedef enum {
    NF_FOREVER,    /* no deadline */
    NF_FIXED,      /* nothing */
    NF_PER_CLIMB,  /* four times the height to go at the climb or landing rate */
    NF_PER_METRE,  /* 2 s for each metre to go, which is NF_SLOW_CM_S */
    NF_PER_TURN,   /* 72 s for each turn, which is 5 degrees a second */
    NF_PER_RECORD, /* the record's seconds */
    NF_NO_FIX_TIME /* the setting `fix_s` */
} nf_allowance_t;

typedef struct {
    const char *name;
    nf_mode_t mode;       /* commanded in this state */
    nf_allowance_t rule;
    uint32_t base_ms;
    nf_state_t then;      /* at the deadline */
    nf_reason_t reason;   /* ... reported then */
} nf_row_t;

extern const nf_row_t nf_states[NF_STATES];

/* What a low battery does. */
typedef enum { NF_BATTERY_TOLD, NF_BATTERY_HOME, NF_BATTERY_LANDS } nf_battery_t;

/* The pilot's settings. Copied when the craft is armed. */
typedef struct {
    bool enabled;
    uint16_t radius_cm;       /* smallest hit radius: gps_wp_radius */
    uint16_t first_m;         /* farthest first place */
    uint16_t height_m;        /* greatest height */
    uint16_t fence_m;         /* greatest distance from home; 0: any */
    uint16_t climb_cm_s;      /* climb and descent between records */
    uint16_t launch_cm_s;     /* climb of the firmware's take-off */
    uint16_t landing_cm_s;
    uint16_t speed_cm_s;      /* cruise speed; heights are changed over the estimated time of a leg */
    uint16_t fix_s;           /* without a fix for so long, land */
    uint16_t home_m;          /* least height of the way home */
    uint16_t lean_cd;         /* greatest lean, 1/100 degree */
    bool failsafe_lands;      /* failsafe lands at once instead of flying home */
    nf_battery_t battery;
} nf_settings_t;

/* The state of the craft at one call. */
typedef struct {
    uint32_t now_ms;
    nf_place_t place;
    nf_place_t home;          /* the launch place */
    int32_t height_cm;        /* above the launch place */
    int32_t climb_cm_s;
    int32_t heading_cd;       /* 1/100 degree, clockwise from north, any range; with the correction of the last call */
    st_vector_t velocity;     /* over ground, by the GPS, cm/s */
    st_vector_t felt;         /* change of velocity since the last call, by the accelerometer, cm/s */
    st_vector_t lean_cd;      /* the craft's lean towards north and east, 1/100 degree */
    bool new_fix;             /* place and velocity are new */
    nm_list_t list;           /* the list that is stored now */
    bool switch_on;
    bool armed;
    bool flying;              /* false: the craft is on the ground. True once its throttle was high, on the ground too */
    bool fix;                 /* good enough for position hold */
    bool home_known;
    bool instruments;         /* compass and barometer work and are calibrated */
    bool failsafe;
    bool rtl;                 /* the pilot's, or failsafe's */
    bool stick;               /* roll or pitch beyond the deadband */
    bool yaw_stick;
    bool throttle_middle;     /* throttle stick in its middle zone */
    bool battery_low;
} nf_input_t;

typedef struct {
    nf_mode_t mode;
    nf_place_t target;        /* for display: NF_GO, NF_TAKEOFF, NF_LAND */
    st_mode_t steer;          /* ST_NONE: no lean is commanded */
    st_vector_t lean_cd;      /* towards north and east, 1/100 degree */
    int32_t correction_cd;    /* to add to the compass's heading from now on, in every mode */
    bool pilots_throttle;     /* NF_HOLD, NF_LEVEL: the stick climbs and descends; else climb_cm_s holds the height */
    bool nose;                /* turn to heading_cd; else the yaw stick turns it, or the firmware holds the heading */
    int16_t climb_cm_s;       /* 0: hold the height */
    int32_t heading_cd;       /* 0..35999 */
    int32_t takeoff_cm;       /* NF_TAKEOFF: height above the place of the start */
} nf_output_t;

/* Read one record of NM_RECORD_SIZE bytes. False if there is none. */
typedef bool (*nf_read_t)(void *self, uint16_t number, uint8_t *record);

/* A record, decoded. */
typedef struct {
    nf_place_t place;
    int16_t height_m;
    int8_t turns;
    uint8_t seconds;          /* LOITER_TIME; WAYPOINT: 1 brake */
    uint8_t radius_m;
    uint8_t command;
    bool roi;                 /* nose to the region of interest */
} nf_record_t;

/* All of the core's state. Fields in the first group are the progress; all are for reading only. */
typedef struct {
    nf_state_t state;
    nf_reason_t reason;
    uint16_t record;          /* in flight or left; NF_NO_RECORD: none */
    uint16_t reached;         /* the record whose place was reached last; NF_NO_RECORD: none */
    uint16_t count;           /* of records in the list */
    uint32_t distance_cm;     /* to the target; 0 without one */
    int32_t bearing_cd;       /* ... */
    int32_t height_error_cm;  /* target height minus height; 0 without a target height */
    bool battery_low;

    nf_read_t read;
    void *self;
    nf_settings_t settings;
    nm_list_t list;           /* at arming */
    bool armed, switch_on;    /* at the last call */
    bool used;                /* a flight has begun since arming: the compass's correction is used */
    bool begun;               /* `record` is where a flight was left */
    bool grounded;            /* a take-off from the ground has not left it yet */
    bool throttle_works;      /* the throttle was in its middle zone since the start */
    bool nose_is_pilots;      /* turned by the yaw stick since the leg began */
    bool roi_known;
    bool adjusting;           /* climbing or descending */
    bool holding;             /* `target` is the place of a hold, or was flown to; else the craft brakes */
    bool unsteered;           /* a landing without a place */
    bool waits;               /* NF_DESCENT: at this height, until the craft is slow over the ground */
    bool climbs_first;        /* NF_HOME: at `target`, before it flies home */
    uint8_t slow;             /* windows without progress */
    nf_record_t now;          /* the record in flight */
    nf_place_t target, roi, last;
    nf_place_t place;         /* at the last fix that was believed, ... */
    st_vector_t flown_cm;     /* ... and what was flown since */
    bool placed;              /* `place` is known */
    bool jumping, jumped;     /* the fixes are not believed; since this call they are again */
    bool battery_acts;
    st_t steer;
    uint32_t entered_ms, allowed_ms, mark_ms, braking_ms, nearer_ms, grown_ms, calm_ms, near_turn_ms, compass_ms, jump_ms, charged_ms;
    uint32_t mark_cm, far_cm, nearest_cm;
    int32_t ground_cm;        /* height at take-off */
    int32_t height_cm;        /* target height */
    int32_t nose_cd;
    int32_t to_turn_cd;
    int32_t heading_cd;       /* at the last call */
    int32_t correct_cd;       /* the compass's correction at this call, ... */
    int32_t corrected_cd;     /* ... which the heading of the next one has */
    st_mode_t steering;       /* at the last call */
    uint32_t checksum;        /* NF_CHECK: over the records so far */
    uint16_t next;            /* NF_CHECK: the next record */
    bool first;               /* NF_CHECK: no place was checked yet, and no flight was left */
} nf_t;

/* Prepare `f`. The list is read with `read`, which is passed `self`. */
void nf_start(nf_t *f, nf_read_t read, void *self);

/* One control loop. `settings` are taken over while disarmed. The place in `in` is replaced if it is not believed. */
void nf_step(nf_t *f, const nf_settings_t *settings, nf_input_t *in, nf_output_t *out);

/* Distance in cm and bearing in 1/100 degree (0..35999) between places that are a few kilometres apart. */
uint32_t nf_distance(const nf_place_t *from, const nf_place_t *to, int32_t *bearing_cd);

#endif
