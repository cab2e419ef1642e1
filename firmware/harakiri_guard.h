/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Decides which MSP requests Harakiri evaluates. The patches ask before a request reaches evaluateCommand() (serial.c).
 *
 * Harakiri's handlers take a request's payload from a buffer that still holds bytes of the previous request, and check neither
 * its size nor the armed flag. So a setter without payload would store stale bytes, and a calibration, a reset of
 * the settings or a flash write would stop a flying craft's main loop for 0.15 to 25 s, or reset it.
 */
#ifndef HARAKIRI_GUARD_H
#define HARAKIRI_GUARD_H

#include <stdbool.h>
#include <stdint.h>

/*
 * False for a request that must be refused with an error reply:
 *   - a command that reads its payload, with a payload of another size;
 *   - a command without payload that calibrates, resets the settings or writes the flash, with a payload;
 *   - any of the latter while the motors may run, or when it would write the configuration and the write budget is spent
 *     (ConfigSpendWrite()).
 * Every other request passes, even an unknown command: Harakiri itself answers those with an error.
 */
bool GuardAccepts(uint8_t command, uint8_t size);

/* True while armed. With FEATURE_PASS, which never arms, while the throttle is up: there it drives the motors directly. */
bool MotorsMayRun(void);

#endif
