/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Replaces Harakiri's headers when harakiri_mission.c is tested on the host: only the names that it uses.
 * test_harakiri.c defines the functions; the flash is memory at the STM32F103's address.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#ifndef FLASH_PAGE_COUNT
#define FLASH_PAGE_COUNT 128
#endif
#define FLASH_PAGE_SIZE ((uint16_t)0x400)
#define FLASH_PAGES_FORCONFIG 3
#define FLASH_WRITE_ADDR (0x08000000 + (uint32_t)FLASH_PAGE_SIZE * (FLASH_PAGE_COUNT - FLASH_PAGES_FORCONFIG))

typedef enum { FLASH_BUSY = 1, FLASH_ERROR_PG, FLASH_ERROR_WRP, FLASH_COMPLETE } FLASH_Status;
enum { FLASH_FLAG_EOP = 0x20, FLASH_FLAG_PGERR = 4, FLASH_FLAG_WRPRTERR = 0x10 };

void FLASH_Unlock(void);
void FLASH_Lock(void);
void FLASH_ClearFlag(uint32_t flags);
FLASH_Status FLASH_ErasePage(uint32_t address);
FLASH_Status FLASH_ProgramHalfWord(uint32_t address, uint16_t data);

#define FDByteSize 2340

typedef struct {
    uint8_t bytes[16];
} wp_t;

typedef struct {
    uint8_t version;
    uint16_t size;
    uint8_t magic_be;
    uint16_t gps_wp_radius;
    uint16_t rc_minchk;
    uint8_t rc_auxch;
    uint8_t others[500];
    uint8_t rc_db;
    int8_t gbl_pgn;
    uint8_t gbl_flg;
    int16_t mag_dec;
    uint16_t esc_moff;
    uint32_t serial_baudrate;
    float bar_lag;
    uint8_t acc_hdw;
    uint8_t mag_gain;
    int8_t align[3][3];
    float angleTrim[2];
    float accZero[3];
    int16_t sens_1G;
    uint8_t acc_calibrated;
    uint8_t mag_calibrated;
    uint16_t FDUsedDatasets;
    uint8_t FloppyDisk[FDByteSize];
    uint8_t magic_ef;
    uint8_t chk;
} config_t;

typedef struct {
    uint8_t ARMED;
} flags_t;

enum { THROTTLE = 3 };
enum { PIDITEMS = 10, CHECKBOXITEMS = 15 };
enum { FEATURE_PASS = 1 << 9 };

extern config_t cfg;
extern flags_t f;
extern int16_t rcData[8];
extern uint32_t ScheduleEEPROMwriteMS;

uint32_t millis(void);
bool feature(uint32_t mask);
void writeParams(uint8_t b);

#endif
