/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Decides which MSP requests Harakiri evaluates. The patches ask before a request reaches evaluateCommand() (serial.c).
 *
 * Harakiri's handlers take a request's payload from a buffer that still holds bytes of the previous request, and check neither
 * its size nor the armed flag. So a setter without payload would store stale bytes. In flight, new PIDs, boxes or rates could
 * make the craft fall or disarm it, and a calibration, a reset of the settings or a flash write would stop the main loop for
 * 0.15 to 25 s, or reset the board.
 */
#ifndef HARAKIRI_GUARD_H
#define HARAKIRI_GUARD_H

#include <stdbool.h>
#include <stdint.h>

/*
 * False for a request that must be refused with an error reply:
 *   - while the motors may run, every command from SET_RAW_RC (200) on, except the read DEBUG (254);
 *   - a command that reads its payload, with a payload of another size;
 *   - a command without payload that calibrates, resets the settings or writes the flash, with a payload, or when it would
 *     write the configuration and the write budget is spent (ConfigSpendWrite()).
 * Every other request passes: reads, the mission extension's requests, which check the armed flag themselves, and unknown
 * commands below 200, which Harakiri itself answers with an error.
 */
bool GuardAccepts(uint8_t command, uint8_t size);

/* True while armed. With FEATURE_PASS, which never arms, while the throttle is up: there it drives the motors directly. */
bool MotorsMayRun(void);

#endif
