/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "harakiri_config.h"

#include <stddef.h>
#include <string.h>

#include "board.h"
#include "harakiri_flash.h"
#include "harakiri_mission.h"
#include "mw.h"

enum {
    SETTINGS_SIZE = offsetof(config_t, FDUsedDatasets), /* of the staged part of cfg: all but the list and the checksum */
    LIST_AT = SETTINGS_SIZE,                            /* then the identity of the list's copy in cfg: CRC-32, count */
    STAGED_SIZE = LIST_AT + 6,
    PLACE_PAGE = 1 + NM_PAGES,
    PLACE_SIZE = FLASH_PAGES_FORCONFIG * NS_PAGE_SIZE
};

typedef char settings_fit_their_page[STAGED_SIZE + NS_HEADER_SIZE <= NS_PAGE_SIZE && SETTINGS_SIZE % 2 == 0 ? 1 : -1];
typedef char header_fits_after_the_configuration[sizeof(config_t) + NS_HEADER_SIZE <= PLACE_SIZE ? 1 : -1];

static const ns_flash_t flash = {FlashErasePage, FlashProgram, FlashAddress};
static const ns_slot_t staged = {0, 1, NS_PAGE_SIZE - NS_HEADER_SIZE, 0, 1, STAGED_SIZE};
static const ns_slot_t place = {PLACE_PAGE, FLASH_PAGES_FORCONFIG, PLACE_SIZE - NS_HEADER_SIZE, 0, 1, sizeof(config_t)};

#define SELF ((void *)(uintptr_t)CONFIG_STAGED_ADDR)

static uint32_t last_sequence(void)
{
    const uint32_t one = ns_valid(&flash, SELF, &staged) ? ns_sequence(&flash, SELF, &staged) : 0;
    const uint32_t other = ns_valid(&flash, SELF, &place) ? ns_sequence(&flash, SELF, &place) : 0;
    return one - other < 0x80000000u ? one : other;
}

/* False if the place is incomplete, or older than the first slot: a write was interrupted. */
static bool place_is_newest(void)
{
    return ns_valid(&flash, SELF, &place) && ns_sequence(&flash, SELF, &place) == last_sequence();
}

/* Identify the list in a configuration, 6 bytes. */
static void identify_list(uint8_t *to, const config_t *configuration)
{
    const uint16_t count = configuration->FDUsedDatasets <= NM_CAPACITY ? configuration->FDUsedDatasets : 0;
    ns_put32(to, nm_crc32(0, configuration->FloppyDisk, count * NM_RECORD_SIZE));
    ns_put16(to + 4, count);
}

static void stage(void)
{
    const uint32_t sequence = last_sequence() + 1;
    uint8_t list[STAGED_SIZE - LIST_AT];
    identify_list(list, &cfg);
    if (ns_erase(&flash, SELF, &staged) && ns_program(&flash, SELF, &staged, 0, (const uint8_t *)&cfg, SETTINGS_SIZE) &&
        ns_program(&flash, SELF, &staged, LIST_AT, list, sizeof list))
        (void)ns_seal(&flash, SELF, &staged, STAGED_SIZE, sequence);
}

bool ConfigIsWritten(void)
{
    /* The checksum need not be compared, and ConfigSpendWrite() asks before it is computed. */
    return ns_valid(&flash, SELF, &place) && memcmp(ns_data(&flash, SELF, &place), &cfg, offsetof(config_t, chk)) == 0;
}

void ConfigStage(void)
{
    if (place_is_newest() || !ns_valid(&flash, SELF, &staged)) /* else the first slot holds what is being written */
        stage();
}

void ConfigWritten(void)
{
    if (memcmp(ns_data(&flash, SELF, &place), &cfg, sizeof cfg) == 0)
        (void)ns_seal(&flash, SELF, &place, sizeof cfg, last_sequence() + 1);
}

/* Take over the configuration that another build has written to the place. */
static void adopt(void)
{
    uint8_t list[STAGED_SIZE - LIST_AT];
    memcpy(&cfg, ns_data(&flash, SELF, &place), sizeof cfg);
    identify_list(list, &cfg);
    if (ns_valid(&flash, SELF, &staged) && memcmp(ns_data(&flash, SELF, &staged) + LIST_AT, list, sizeof list))
        MissionImport();
    stage();
    ConfigWritten();
}

void ConfigStart(bool valid, uint8_t version)
{
    if (valid && ns_blank(ns_header(&flash, SELF, &place), NS_HEADER_SIZE)) {
        adopt();
        return;
    }
    if (place_is_newest() || !ns_valid(&flash, SELF, &staged))
        return;
    memcpy(&cfg, ns_data(&flash, SELF, &staged), SETTINGS_SIZE);
    cfg.FDUsedDatasets = 0;
    if (cfg.version != version || cfg.size != sizeof cfg)
        return; /* of another build */
    MissionLoad();
    writeParams(0);
}

bool ConfigSpendWrite(void)
{
    return ConfigIsWritten() || MissionSpendWrite();
}
