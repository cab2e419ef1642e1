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
 * The configuration has been read into cfg, or an upload has failed: put the stored list in place. The first call finds it;
 * if there is none yet, a list in the configuration (of the time before the patch) becomes it.
 */
void MissionLoad(void);

/* The configuration is about to be written: store the list in cfg if it is another one. Does nothing while armed. */
void MissionStore(void);

/* Once per main loop. */
void MissionPoll(void);

/* nm_handle() on the receive buffer. */
int MissionRequest(uint8_t command, uint8_t *buffer, uint8_t size);

#endif
