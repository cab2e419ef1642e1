/* SPDX-License-Identifier: GPL-3.0-or-later */
/* See naze_steer.h, which is the manual. */
#include "naze_steer.h"

#include <math.h>
#include <string.h>

#define GRAVITY_CM_S2 980.665f
#define CD_PER_RAD 5729.578f
#define FOLLOW 0.9f        /* of the difference between GPS and estimate, at each fix */
#define LEAN_S 0.2f        /* how fast the craft follows a lean */
#define AIR_S 0.7f         /* memory of the air's push */
#define HIGH_PASS_S 2.0f
#define KEEP_S 6.0f          /* the compass sums' memory */
#define AGREE 0.8f         /* least part of both motions that is the same, squared */
#define MOST_WIND 0.8f     /* of the greatest lean */
#define SURE_CD 1000.0f    /* a smaller error is not corrected, ... */
#define DONE_CD 300.0f     /* ... a larger one until it is this small */

const st_gains_t st_careful = {0.12f, 0.8f, 0.01f};
const st_gains_t st_firm = {0.22f, 1.0f, 0.04f};

static st_vector_t sum(st_vector_t a, st_vector_t b, float factor)
{
    a.n += b.n * factor;
    a.e += b.e * factor;
    return a;
}

static float length(st_vector_t a)
{
    return sqrtf(a.n * a.n + a.e * a.e);
}

static st_vector_t limited(st_vector_t a, float most)
{
    const float now = length(a);
    const float factor = now > most ? most / now : 1.0f;
    a.n *= factor;
    a.e *= factor;
    return a;
}

/* Turned clockwise by an angle in radians. */
static st_vector_t turned(st_vector_t a, float angle)
{
    const float c = cosf(angle), s = sinf(angle);
    const st_vector_t b = {a.n * c - a.e * s, a.n * s + a.e * c};
    return b;
}

void st_start(st_t *s, uint32_t now_ms)
{
    memset(s, 0, sizeof *s);
    s->now_ms = s->fix_ms = s->memory_ms = now_ms;
}

static bool is_blind(const st_t *s)
{
    return !s->has_fix || s->now_ms - s->fix_ms > ST_BLIND_MS;
}

/* ---- velocity --------------------------------------------------------------------------------------------------------- */

/* The felt velocity when the fix was measured. */
static st_vector_t felt_at_fix(const st_t *s)
{
    return s->memory[(s->newest + ST_MEMORY - ST_LAG_MS / ST_MEMORY_MS) % ST_MEMORY];
}

static void remember(st_t *s)
{
    while (s->now_ms - s->memory_ms >= ST_MEMORY_MS) {
        s->memory_ms += ST_MEMORY_MS;
        s->newest = (uint8_t)((s->newest + 1u) % ST_MEMORY);
        s->memory[s->newest] = s->felt;
    }
}

static void correct_velocity(st_t *s, st_vector_t gps)
{
    const st_vector_t off = sum(gps, sum(s->base, felt_at_fix(s), 1.0f), -1.0f);
    s->base = sum(s->base, off, s->has_fix ? FOLLOW : 1.0f);
    s->has_fix = true;
}

/* ---- compass ---------------------------------------------------------------------------------------------------------- */

static st_vector_t high_passed(st_t *s, unsigned which, st_vector_t value, float keep)
{
    const st_vector_t before = s->once[which];
    st_vector_t *once = &s->once[which], *twice = &s->twice[which];
    once->n = keep * (once->n + value.n - s->last[which].n);
    once->e = keep * (once->e + value.e - s->last[which].e);
    twice->n = keep * (twice->n + once->n - before.n);
    twice->e = keep * (twice->e + once->e - before.e);
    s->last[which] = value;
    return *twice;
}

/* Everything that was felt is turned by the part of the compass error that is corrected now, radians. */
static void turn_felt(st_t *s, float angle)
{
    unsigned i;
    const st_vector_t velocity = sum(s->base, s->felt, 1.0f), sums = {s->agree_re, s->agree_im};
    const st_vector_t left = turned(sums, -angle);
    s->felt = turned(s->felt, angle);
    for (i = 0; i < ST_MEMORY; i++)
        s->memory[i] = turned(s->memory[i], angle);
    s->last[1] = turned(s->last[1], angle);
    s->once[1] = turned(s->once[1], angle);
    s->twice[1] = turned(s->twice[1], angle);
    s->wind = turned(s->wind, angle);
    s->air = turned(s->air, angle);
    s->leant = turned(s->leant, angle);
    s->base = sum(velocity, s->felt, -1.0f);
    s->agree_re = left.n;
    s->agree_im = left.e;
}

static void compare_compass(st_t *s, st_vector_t gps, float dt)
{
    const float keep = HIGH_PASS_S / (HIGH_PASS_S + dt), age = 1.0f - dt / KEEP_S;
    const st_vector_t v = high_passed(s, 0, gps, keep), a = high_passed(s, 1, felt_at_fix(s), keep);
    float angle, step;
    s->agree_re = age * s->agree_re + a.n * v.n + a.e * v.e;
    s->agree_im = age * s->agree_im + a.n * v.e - a.e * v.n;
    s->moved = age * s->moved + v.n * v.n + v.e * v.e;
    s->felt_moved = age * s->felt_moved + a.n * a.n + a.e * a.e;
    if (s->moved < ST_ENOUGH || s->felt_moved < ST_ENOUGH ||
        s->agree_re * s->agree_re + s->agree_im * s->agree_im < AGREE * s->moved * s->felt_moved)
        return;
    s->compass_known = true;
    angle = atan2f(s->agree_im, s->agree_re) * CD_PER_RAD;
    s->correcting = fabsf(angle) > (s->correcting ? DONE_CD : SURE_CD);
    if (!s->correcting)
        return;
    step = angle > ST_STEP_CD ? ST_STEP_CD : angle < -ST_STEP_CD ? -ST_STEP_CD : angle;
    s->correction_cd += (int32_t)step;
    if (s->correction_cd > 18000)
        s->correction_cd -= 36000;
    if (s->correction_cd < -18000)
        s->correction_cd += 36000;
    turn_felt(s, (float)(int32_t)step / CD_PER_RAD);
}

/* What the accelerometer feels beyond the lean is the push of the air: known at once, whatever the compass says. */
static void feel_air(st_t *s, st_vector_t felt)
{
    const float dt = 0.02f;
    s->leant = sum(s->leant, sum(s->asked, s->leant, -1.0f), dt / LEAN_S);
    if (s->steers && !is_blind(s)) {
        st_vector_t push = sum(felt, s->leant, -dt);
        push.n /= dt;
        push.e /= dt;
        s->air = sum(s->air, sum(push, s->air, -1.0f), dt / AIR_S);
    }
}

void st_sense(st_t *s, const st_sense_t *in)
{
    s->now_ms = in->now_ms;
    if (!in->flying) {
        const int32_t correction_cd = s->correction_cd;
        const bool known = s->compass_known;
        st_start(s, in->now_ms);
        s->correction_cd = correction_cd;
        s->compass_known = known;
        return;
    }
    s->felt = sum(s->felt, in->felt, 1.0f);
    feel_air(s, in->felt);
    remember(s);
    if (in->new_fix) {
        const uint32_t since_ms = in->now_ms - s->fix_ms;
        const bool in_time = s->has_fix && since_ms < ST_BLIND_MS;
        s->fix_ms = in->now_ms;
        if (in_time && in->compares)
            compare_compass(s, in->velocity, (float)since_ms * 0.001f);
        else {
            s->has_fix = in_time;
            s->last[0] = in->velocity;
            s->last[1] = felt_at_fix(s);
            memset(s->once, 0, sizeof s->once);
            memset(s->twice, 0, sizeof s->twice);
        }
        correct_velocity(s, in->velocity);
    }
    s->velocity = sum(s->base, s->felt, 1.0f);
}

/* ---- steering --------------------------------------------------------------------------------------------------------- */

void st_begin(st_t *s, st_vector_t lean_cd)
{
    const float factor = GRAVITY_CM_S2 / CD_PER_RAD;
    const st_vector_t none = {0.0f, 0.0f};
    s->wind = none;
    s->leant.n = lean_cd.n * factor;
    s->leant.e = lean_cd.e * factor;
    s->asked = s->leant;
    s->air = sum(none, s->leant, -1.0f);
}

float st_speed(const st_t *s)
{
    return length(s->velocity);
}

st_vector_t st_ahead(const st_t *s, st_vector_t way)
{
    return sum(way, s->velocity, -(float)(ST_LAG_MS + s->now_ms - s->fix_ms) * 0.001f);
}

static st_vector_t wanted(const st_t *s, const st_order_t *order, const st_gains_t *gains)
{
    const float near_cm = ST_BRAKE_CM_S2 / (gains->position * gains->position);
    st_vector_t way = {0.0f, 0.0f};
    float distance, speed = order->cruise_cm_s;
    if (order->mode != ST_PASS && order->mode != ST_STAY)
        return way;
    way = st_ahead(s, order->way);
    distance = length(way);
    if (distance < 1.0f)
        return way;
    if (order->mode == ST_STAY) {
        const float most = distance < near_cm ? gains->position * distance
                                              : sqrtf(2.0f * ST_BRAKE_CM_S2 * (distance - 0.5f * near_cm));
        if (speed > most)
            speed = most;
    }
    way.n *= speed / distance;
    way.e *= speed / distance;
    return way;
}

static st_vector_t as_lean(st_vector_t acceleration)
{
    const float size = length(acceleration);
    const float factor = size > 0.0f ? atanf(size / GRAVITY_CM_S2) * CD_PER_RAD / size : 0.0f;
    acceleration.n *= factor;
    acceleration.e *= factor;
    return acceleration;
}

st_vector_t st_steer(st_t *s, const st_order_t *order)
{
    const st_vector_t none = {0.0f, 0.0f};
    const float dt = 0.02f, most = GRAVITY_CM_S2 * tanf((float)order->most_cd / CD_PER_RAD);
    const st_gains_t *gains = s->compass_known ? &st_firm : &st_careful;
    st_vector_t off, change, lean;
    if (order->mode == ST_NONE) {
        s->steers = false;
        s->asked = none;
        return none;
    }
    if (!s->steers)
        s->wanted = s->velocity;
    s->steers = true;
    if (is_blind(s) || order->mode == ST_LEAN) {
        s->wanted = none;
        s->asked = limited(sum(s->wind, s->air, -1.0f), MOST_WIND * most);
        return as_lean(s->asked);
    }
    change = sum(wanted(s, order, gains), s->wanted, -1.0f);
    s->wanted = sum(s->wanted, limited(change, (order->mode >= ST_PASS ? ST_GATHER_CM_S2 : ST_STOP_CM_S2) * dt), 1.0f);
    off = sum(s->wanted, s->velocity, -1.0f);
    lean = sum(sum(s->wind, s->air, -1.0f), off, order->mode == ST_STOP ? ST_STOP_SPEED : gains->speed);
    if (length(lean) < most || off.n * s->wind.n + off.e * s->wind.e < 0.0f)
        s->wind = limited(sum(s->wind, off, gains->wind * dt), MOST_WIND * most);
    s->asked = limited(lean, most);
    return as_lean(s->asked);
}
