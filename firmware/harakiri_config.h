/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Harakiri's configuration in two slots (naze_slots.h), so that a power cut while it is written costs nothing. The patches
 * insert these calls into config.c.
 *
 * The second slot is the place that Harakiri has always had: an unpatched build finds there the configuration that was
 * written last, in its own format. The slot's header is behind it, where Harakiri leaves the last page unused. The first
 * slot, one page, holds what is about to be written there, without the mission list, which has its own slots.
 *
 * writeParams() fills and seals the first slot (ConfigStage()), erases and programs the place, and seals it (ConfigWritten()).
 * If the power is cut before the first seal, the old configuration is whole in its place; after it, the new one is whole in the
 * first slot, and the next start finishes the write (ConfigStart()).
 *
 * A place with Harakiri's own checksum right, but without any header, was written by a build without this file. It is the
 * newer one then, and is adopted, with its mission list if that build has changed it.
 */
#ifndef HARAKIRI_CONFIG_H
#define HARAKIRI_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

/*
 * At the start, before the configuration is checked: finish an interrupted write, or adopt the configuration of another build.
 * `valid` is Harakiri's own check of the place, `version` its EEPROM_CONF_VERSION.
 */
void ConfigStart(bool valid, uint8_t version);

/* True if cfg, with its checksum, is what the place holds: writing it again would only wear the flash. */
bool ConfigIsWritten(void);

/* Before the place is erased: put cfg into the first slot. */
void ConfigStage(void);

/* After the place has been programmed: seal it. */
void ConfigWritten(void);

/*
 * True if a companion may have the configuration written now: either nothing would be written, or the write budget has a
 * write left, which is taken.
 */
bool ConfigSpendWrite(void);

#endif
