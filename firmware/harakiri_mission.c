/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The mission core's board on the Naze32 with Harakiri: flash pages, time, arming, and cfg. */
#include "harakiri_mission.h"

#include "board.h"
#include "harakiri_guard.h"
#include "mw.h"

/* The slots are directly below the configuration. stm32_flash.ld refuses to link a program that reaches LINKED_BELOW. */
#define MISSION_FLASH_ADDR (FLASH_WRITE_ADDR - NM_FLASH_SIZE)
#define LINKED_BELOW 0x0801DC00u

/* Another FLASH_PAGE_COUNT moves the configuration and with it the slots: stm32_flash.ld must then be changed too. */
typedef char slots_lie_where_stm32_flash_ld_says[MISSION_FLASH_ADDR == LINKED_BELOW ? 1 : -1];

static nm_t mission;

static bool erase_page(void *self, uint8_t page)
{
    FLASH_Status status;
    (void)self;
    FLASH_Unlock();
    FLASH_ClearFlag(FLASH_FLAG_EOP | FLASH_FLAG_PGERR | FLASH_FLAG_WRPRTERR);
    status = FLASH_ErasePage(MISSION_FLASH_ADDR + (uint32_t)page * NM_PAGE_SIZE);
    FLASH_Lock();
    return status == FLASH_COMPLETE;
}

static bool program(void *self, uint16_t offset, const uint8_t *data, uint16_t length)
{
    FLASH_Status status = FLASH_COMPLETE;
    uint16_t i;
    (void)self;
    FLASH_Unlock();
    FLASH_ClearFlag(FLASH_FLAG_EOP | FLASH_FLAG_PGERR | FLASH_FLAG_WRPRTERR);
    for (i = 0; i < length && status == FLASH_COMPLETE; i += 2)
        status = FLASH_ProgramHalfWord(MISSION_FLASH_ADDR + offset + i, (uint16_t)(data[i] | data[i + 1] << 8));
    FLASH_Lock();
    return status == FLASH_COMPLETE;
}

static const uint8_t *flash(void *self)
{
    const volatile uintptr_t address = MISSION_FLASH_ADDR; /* volatile: see nm_board_t */
    (void)self;
    return (const uint8_t *)address;
}

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
    erase_page, program, flash, now_ms, armed, write_pending, radius, set_radius, list_changed,
};

/* The core must report the firmware's capacity. */
typedef char floppy_holds_capacity[FDByteSize / sizeof(wp_t) == NM_CAPACITY && sizeof(wp_t) == NM_RECORD_SIZE ? 1 : -1];

void MissionLoad(void)
{
    if (!mission.board) {
        nm_start(&mission, &board, NULL);
        if (!nm_records(&mission))
            (void)nm_store(&mission, cfg.FloppyDisk, cfg.FDUsedDatasets);
    }
    list_changed(NULL, nm_records(&mission), mission.stored.count);
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

int MissionRequest(uint8_t command, uint8_t *buffer, uint8_t size)
{
    return nm_handle(&mission, command, buffer, size);
}
