/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Experimental: flown in simulation only. First flights: propellers off, then on a tether, then with height.
 *
 * Steering for mission flight (naze_flight.h): leans the craft so that it flies to a place, stays there, or stops. It takes
 * the speed over ground from the GPS and the change of speed from the accelerometer, and finds out from the two how far the
 * compass is off. No heap, no I/O, no globals: the caller owns all state, one st_t. Vectors are north and east.
 *
 * CONTROL
 *   The wanted velocity leads to the place: `position` for each cm, above that as fast as it can stop with ST_BRAKE_CM_S2,
 *   at most the cruise speed. The lean is an acceleration: `speed` for each cm/s of velocity error, against the push of the
 *   air, which is what the accelerometer feels beyond the lean, and the integral of the error with `wind`, for a level that is
 *   off. There are two sets of these gains: st_careful until the compass error is known, then st_firm.
 *
 *   Margin, without any correction of the compass, with a craft of 0.5 to 2 kg: st_careful holds a place and stops with a compass
 *   that is off by 56 to 60 degrees at a GPS lag of 0.2 s, and by 46 to 50 at 0.5 s; st_firm with 49 to 52, and 36 to 41.
 *   `make -C firmware margin` computes it.
 *
 * COMPASS
 *   The accelerometer's change of velocity is turned by the heading, the GPS's is not: the angle between the two is the
 *   compass error. Both are high-passed (two stages of 2 s), so a tilted level or a slow drift does not count, and summed over
 *   about 6 s. The error is used once the craft has moved enough (ST_ENOUGH) and the two agree; above 10 degrees `correction_cd`
 *   follows it by at most ST_STEP_CD a fix. The caller adds it to the heading that it turns the lean and the accelerometer by.
 */
#ifndef NAZE_STEER_H
#define NAZE_STEER_H

#include <stdbool.h>
#include <stdint.h>

#define ST_BRAKE_CM_S2 60.0f
#define ST_GATHER_CM_S2 150.0f /* greatest change of the wanted velocity, ... */
#define ST_STOP_CM_S2 600.0f   /* ... and when it stops, */
#define ST_STOP_SPEED 1.8f     /* ... with this gain for the speed, 1/s: without a place to fly to it may be higher */
#define ST_LAG_MS 250u         /* the assumed age of a fix */
#define ST_ENOUGH 25000.0f     /* (cm/s)2, summed */
#define ST_STEP_CD 500
#define ST_MEMORY 16u          /* of the felt velocity, every ST_MEMORY_MS */
#define ST_MEMORY_MS 40u
#define ST_BLIND_MS 2000u      /* without a fix for longer than this, the velocity is unknown */

typedef struct {
    float n, e;
} st_vector_t;

typedef struct {
    float position, speed, wind; /* 1/s, 1/s, 1/s2 */
} st_gains_t;

extern const st_gains_t st_careful, st_firm;

/* The measurements of one call. */
typedef struct {
    uint32_t now_ms;
    st_vector_t felt;     /* change of velocity since the last call by the accelerometer, cm/s */
    st_vector_t velocity; /* by the GPS, cm/s */
    bool new_fix;         /* `velocity` and the place are new */
    bool flying;          /* false: on the ground, where the accelerometer feels no motion */
    bool compares;        /* the compass's correction is used: measure it */
} st_sense_t;

typedef enum {
    ST_NONE, /* no lean: nothing is steered */
    ST_LEAN, /* lean into the wind; the pilot's sticks add to it */
    ST_STOP, /* brake; blind, keep the lean into the wind */
    ST_PASS, /* fly to the place and through it */
    ST_STAY  /* fly to the place and stay there */
} st_mode_t;

typedef struct {
    st_mode_t mode;
    st_vector_t way;     /* from the last fix to the place, cm */
    float cruise_cm_s;
    int32_t most_cd;     /* greatest lean, 1/100 degree */
} st_order_t;

/* All of the state; `velocity` and the two about the compass are for reading. */
typedef struct {
    st_vector_t velocity;  /* estimate, cm/s */
    int32_t correction_cd; /* to add to the heading, 1/100 degree: minus the compass error */
    bool compass_known;    /* ... it has been measured since the start */

    st_vector_t base;                    /* velocity = base + felt */
    st_vector_t felt, memory[ST_MEMORY]; /* the sum of what was felt: now and before */
    st_vector_t wanted;                  /* velocity */
    st_vector_t asked, leant;            /* acceleration by the lean, cm/s2: asked for, and as the craft follows */
    st_vector_t air, wind;               /* ... by the air, and what is asked for in addition */
    st_vector_t last[2], once[2], twice[2]; /* high-passes of the GPS's velocity and the felt one */
    float agree_re, agree_im, moved, felt_moved;
    uint32_t now_ms, fix_ms, memory_ms;
    uint8_t newest;
    bool has_fix;                        /* a velocity is known */
    bool correcting;                     /* the compass */
    bool steers;                         /* at the last call */
} st_t;

void st_start(st_t *s, uint32_t now_ms);

/* Every call, before st_steer(). */
void st_sense(st_t *s, const st_sense_t *in);

/* Begin to steer: with the lean into the wind that the craft has, 1/100 degree. */
void st_begin(st_t *s, st_vector_t lean_cd);

/* The lean, 1/100 degree towards north and east. */
st_vector_t st_steer(st_t *s, const st_order_t *order);

/* The speed estimate, cm/s. */
float st_speed(const st_t *s);

/* The way to the place, less what was flown since the fix. */
st_vector_t st_ahead(const st_t *s, st_vector_t way);

#endif
