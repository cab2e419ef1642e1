/* SPDX-License-Identifier: GPL-3.0-or-later */
/* harakiri_mission.c includes this too; board.h has all of it. */
