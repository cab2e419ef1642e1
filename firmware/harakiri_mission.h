/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * What Harakiri calls of the mission core (naze_mission.h). The patches put these calls in place.
 *
 * Harakiri goes on working on its own list, cfg.FloppyDisk with cfg.FDUsedDatasets: the CLI, the MAVLink upload and download
 * and everything that may come to fly a mission see that one. The flash slots are where it comes from and where it is kept.
 */
#ifndef HARAKIRI_MISSION_H
#define HARAKIRI_MISSION_H

#include "naze_mission.h"

/*
 * Put the stored list into cfg; call it when the configuration has been read into cfg, and when an upload has failed. With no
 * stored list that is the empty one. The first call looks for the list in flash; if there has never been one there, a list in
 * the configuration (from before the patch) becomes the stored list.
 */
void MissionLoad(void);

/*
 * The configuration is about to be written: store the list in cfg if it is another one. Does nothing while armed. A write in
 * the middle of a MAVLink upload ends the upload, and the stored list stays.
 */
void MissionStore(void);

/*
 * Once per main loop. With FEATURE_PASS, whose main loop does not serve scheduled writes of the configuration, it writes them
 * while the throttle is down.
 */
void MissionPoll(void);

/* The patch adds this to baseflight_mavlink.c: end a MAVLink upload that is under way. True if there was one. */
bool MissionEndUpload(void);

/* nm_handle() on the receive buffer. */
int MissionRequest(uint8_t command, uint8_t *buffer, uint8_t size);

#endif
