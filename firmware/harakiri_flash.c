/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "harakiri_flash.h"

#include "board.h"

/* stm32_flash.ld refuses to link a program that reaches this address. */
#define LINKED_BELOW 0x0801D800u

/* Another FLASH_PAGE_COUNT moves the configuration and with it the slots: stm32_flash.ld must then be changed too. */
typedef char slots_lie_where_stm32_flash_ld_says[CONFIG_STAGED_ADDR == LINKED_BELOW ? 1 : -1];

static void unlock(void)
{
    FLASH_Unlock();
    FLASH_ClearFlag(FLASH_FLAG_EOP | FLASH_FLAG_PGERR | FLASH_FLAG_WRPRTERR);
}

bool FlashErasePage(void *self, uint8_t page)
{
    FLASH_Status status;
    unlock();
    status = FLASH_ErasePage((uint32_t)(uintptr_t)self + (uint32_t)page * NS_PAGE_SIZE);
    FLASH_Lock();
    return status == FLASH_COMPLETE;
}

bool FlashProgram(void *self, uint16_t offset, const uint8_t *data, uint16_t length)
{
    FLASH_Status status = FLASH_COMPLETE;
    uint16_t i;
    unlock();
    for (i = 0; i < length && status == FLASH_COMPLETE; i += 2)
        status = FLASH_ProgramHalfWord((uint32_t)(uintptr_t)self + offset + i, (uint16_t)(data[i] | data[i + 1] << 8));
    FLASH_Lock();
    return status == FLASH_COMPLETE;
}

const uint8_t *FlashAddress(void *self)
{
    void *const volatile address = self; /* volatile: see ns_flash_t */
    return address;
}
