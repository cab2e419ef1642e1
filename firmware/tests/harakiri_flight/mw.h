/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Also included by harakiri_flight.c; everything is in board.h. */
