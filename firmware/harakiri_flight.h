/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Experimental: flown in simulation only. First flights: propellers off, then on a tether, then with height.
 *
 * Harakiri's interface to the flight core (naze_flight.h), for the tree TestCode3. patches/TestCode3-flight.patch inserts
 * these calls. The flight leans the craft itself, and uses Harakiri's own attitude and altitude hold, Autostart and Autoland.
 *
 * All functions are called from the main loop. Stack below FlightRun(): see README.md.
 */
#ifndef HARAKIRI_FLIGHT_H
#define HARAKIRI_FLIGHT_H

#include "naze_flight.h"

/* After the configuration was read: settings that an older build has left out get their defaults. */
void FlightDefaults(void);

/* Failsafe is active in this 50 Hz loop. Call it before FlightRun(). */
void FlightFailsafe(void);

/*
 * Every 50 Hz loop, after failsafe and return-to-launch and before the barometer's part. `rtl`: return-to-launch was
 * requested. `flying`: CopterFlying. Returns true if the flight is in command; then it has set rcOptions, rcData[THROTTLE]
 * and the navigation's target.
 */
bool FlightRun(bool rtl, bool flying);

/* In getEstimatedAttitude(): the heading, with the compass's correction. */
float FlightHeading(float measured);

/* In getEstimatedAttitude(): the change of ACC_speed in this loop, with Harakiri's sign. */
void FlightFeels(const float *change);

/*
 * In getEstimatedAttitude(): true if the accelerometer must not correct the attitude in this loop. While the flight leans the
 * craft to speed it up, the accelerometer shows it level; four of five corrections are left out, so that it takes 10 s
 * instead of 2 to believe that.
 */
bool FlightTrustsGyro(void);

/* Before GPS_angle is used: replaces it with the flight's lean, 1/10 degree. */
void FlightLean(float *lean);

/*
 * The next three are asked in the barometer's part of the 50 Hz loop, in this order. The motors must idle: reset altitude hold,
 * Autostart and Autoland.
 */
bool FlightIdles(void);

/* An Autostart begun by the flight must end now, in the air. True once. */
bool FlightEndsAutostart(void);

/* The craft is on the ground and must take off. */
bool FlightAutostarts(void);

/* Autostart's target height above the present one, cm: the flight's, or `otherwise_cm`. */
int32_t FlightAutostartHeight(int32_t otherwise_cm);

/* In the compass part of the loop: the heading to hold. */
void FlightNose(void);

/* Answer the request FLIGHT of docs/msp-mission.md. Returns the reply's length, or -1 if it is another command. */
int FlightRequest(uint8_t command, uint8_t *buffer, uint8_t size);

/* For MAVLink. The record in flight; false if there is none. */
bool FlightCurrent(uint16_t *record);

/*
 * State, reason and flags as in the reply to FLIGHT, and the record in flight or left (FF: none), from the lowest byte. False
 * while mission flight is off and its switch, too.
 */
bool FlightSummary(int32_t *summary);

/* A record whose place was reached and has not been announced yet; false if there is none. */
bool FlightReached(uint16_t *record);

#endif
