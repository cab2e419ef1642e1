/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The mission core's board on the Naze32 with Harakiri: flash pages, time, arming, and cfg. */
#include "harakiri_mission.h"

#include "board.h"
#include "baseflight_mavlink.h"
#include "harakiri_flash.h"
#include "harakiri_guard.h"
#include "harakiri_settings.h"
#include "mw.h"

static nm_t mission;

static uint32_t now_ms(void *self)
{
    (void)self;
    return millis();
}

static bool armed(void *self)
{
    (void)self;
    return MotorsMayRun();
}

static bool write_pending(void *self)
{
    (void)self;
    return ScheduleEEPROMwriteMS != 0;
}

static uint16_t radius(void *self)
{
    (void)self;
    return cfg.gps_wp_radius;
}

static void set_radius(void *self, uint16_t radius_cm)
{
    (void)self;
    cfg.gps_wp_radius     = radius_cm;
    ScheduleEEPROMwriteMS = 1; /* in this loop, so that arming and missions do not wait for it */
}

static void list_changed(void *self, const uint8_t *records, uint16_t count)
{
    (void)self;
    if (count)
        memcpy(cfg.FloppyDisk, records, count * NM_RECORD_SIZE);
    cfg.FDUsedDatasets = count;
}

static const nm_board_t board = {
    {FlashErasePage, FlashProgram, FlashAddress}, now_ms, armed, write_pending, radius, set_radius, list_changed,
};

/* The core must report the firmware's capacity. */
typedef char floppy_holds_capacity[FDByteSize / sizeof(wp_t) == NM_CAPACITY && sizeof(wp_t) == NM_RECORD_SIZE ? 1 : -1];

static void start(void)
{
    nm_start(&mission, &board, (void *)(uintptr_t)MISSION_FLASH_ADDR);
    if (!nm_records(&mission))
        (void)nm_store(&mission, cfg.FloppyDisk, cfg.FDUsedDatasets);
}

void MissionLoad(void)
{
    if (!mission.board)
        start();
    list_changed(NULL, nm_records(&mission), mission.stored.count);
}

void MissionImport(void)
{
    start();
    (void)nm_store(&mission, cfg.FloppyDisk, cfg.FDUsedDatasets);
}

void MissionStore(void)
{
    if (!mission.board)
        return;
    if (MissionEndUpload())
        MissionLoad();
    else
        (void)nm_store(&mission, cfg.FloppyDisk, cfg.FDUsedDatasets);
}

bool MissionUploaded(void)
{
    const nm_status_t status = nm_store(&mission, cfg.FloppyDisk, cfg.FDUsedDatasets);
    return status == NM_OK || status == NM_SAME;
}

void MissionPoll(void)
{
    nm_poll(&mission);
    if (MotorsMayRun() && MissionEndUpload())
        MissionLoad();
    if (feature(FEATURE_PASS) && ScheduleEEPROMwriteMS && millis() >= ScheduleEEPROMwriteMS && !MotorsMayRun()) {
        writeParams(0);
        ScheduleEEPROMwriteMS = 0;
    }
}

nm_list_t MissionStored(void)
{
    return mission.stored;
}

bool MissionSpendWrite(void)
{
    return nm_spend_write(&mission);
}

int MissionRequest(uint8_t command, uint8_t *buffer, uint8_t size)
{
    const int length = nm_handle(&mission, command, buffer, size);
    return length < 0 ? SettingsRequest(command, buffer, size) : length;
}
