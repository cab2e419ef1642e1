/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the patch adds to Harakiri's header of this name. */
#ifndef BASEFLIGHT_MAVLINK_H
#define BASEFLIGHT_MAVLINK_H

#include <stdbool.h>

bool MissionEndUpload(void);

#endif
