/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The Naze32's flash for naze_slots.h. `self` is the address of page 0: (void *)MISSION_FLASH_ADDR, for example.
 *
 *     CONFIG_STAGED_ADDR   1 page    the configuration, before it is written to its place (harakiri_config.h)
 *     MISSION_FLASH_ADDR   6 pages   the mission lists (naze_mission.h)
 *     FLASH_WRITE_ADDR     3 pages   Harakiri's configuration
 */
#ifndef HARAKIRI_FLASH_H
#define HARAKIRI_FLASH_H

#include "naze_mission.h"

#define MISSION_FLASH_ADDR (FLASH_WRITE_ADDR - NM_FLASH_SIZE)
#define CONFIG_STAGED_ADDR (MISSION_FLASH_ADDR - NS_PAGE_SIZE)

bool FlashErasePage(void *self, uint8_t page);
bool FlashProgram(void *self, uint16_t offset, const uint8_t *data, uint16_t length);
const uint8_t *FlashAddress(void *self);

#endif
