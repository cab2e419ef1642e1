/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Also included by harakiri_mission.c; everything is in board.h. */
