/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Harakiri's interface to the mission core (naze_mission.h). The patches insert these calls.
 *
 * Harakiri still works on its own list, cfg.FloppyDisk with cfg.FDUsedDatasets, as do the CLI, the MAVLink upload and
 * download and anything that flies a mission. It is loaded from the flash slots and stored there.
 */
#ifndef HARAKIRI_MISSION_H
#define HARAKIRI_MISSION_H

#include "naze_mission.h"

/*
 * Load the stored list into cfg, or the empty one if there is none; call it after the configuration was read into cfg, and
 * after a failed upload. The first call looks for the list in flash; if there has never been one there, a list in
 * the configuration (from before the patch) becomes the stored list.
 */
void MissionLoad(void);

/* At the start: make the list in cfg the stored one, because a build without the slots has stored it later. */
void MissionImport(void);

/*
 * Call it before the configuration is written: stores the list in cfg if it has changed. Does nothing while armed. A write
 * during a MAVLink upload ends the upload, and the stored list stays.
 */
void MissionStore(void);

/*
 * A MAVLink upload is complete in cfg: store it, before it is acknowledged. False if that failed; the list in flash is then
 * the old one, and MissionLoad() takes it back.
 */
bool MissionUploaded(void);

/*
 * Once per main loop. Arming ends a MAVLink upload, and the stored list stays. With FEATURE_PASS, whose main loop does not
 * serve scheduled writes of the configuration, it writes them while the throttle is down.
 */
void MissionPoll(void);

/* The stored list. */
nm_list_t MissionStored(void);

/* Take a write of the configuration that a companion asks for from the core's budget. False if it is spent. */
bool MissionSpendWrite(void);

/* Answer a request of the extension, see nm_handle() and SettingsRequest(). */
int MissionRequest(uint8_t command, uint8_t *buffer, uint8_t size);

#endif
