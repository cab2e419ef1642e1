/* SPDX-License-Identifier: GPL-3.0-or-later
 * The Cortex-M3 core on Unicorn: executes code between alarms, enters exceptions and returns from them.
 *
 * Time passes at the start of each block of code, by its size; an interrupt is taken at the start of the next block.
 */
#include "chip.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NEVER_REACHED 0xFFFFFFF0u
#define EXCEPTION_EXIT 8
/* EXC_RETURN (ARMv7-M manual, B1.5.8): to a handler or to thread mode, on the main stack. */
#define TO_HANDLER 0xFFFFFFF1u
#define TO_THREAD 0xFFFFFFF9u
#define FRAME_SIZE 32
#define THUMB_BIT (1u << 24)
#define MAP_PAGE 4096u
/* While interrupts are masked the core looks for one again after this time. */
#define MASKED_PS (2000LL * PS_PER_NS)

static uint32_t get(Chip *chip, int name) {
    uint32_t value = 0;
    uc_reg_read(chip->uc, name, &value);
    return value;
}

static void set(Chip *chip, int name, uint32_t value) { uc_reg_write(chip->uc, name, &value); }

static void on_block(uc_engine *uc, uint64_t address, uint32_t size, void *user) {
    Chip *chip = user;
    chip->now_ps += (int64_t)size * chip->ps_per_byte;
    if (chip->now_ps >= chip->next_ps) let_pass(chip, chip->now_ps);
    if ((uint32_t)address - BOOT_LOADER_BASE < BOOT_LOADER_SIZE) chip->is_in_boot_loader = chip->wants_pause = 1;
    if (chip->now_ps >= chip->end_ps || chip->wants_pause || (chip->nvic.next && chip->now_ps >= chip->masked_until_ps))
        uc_emu_stop(uc);
}

static void on_exception(uc_engine *uc, uint32_t number, void *user) {
    Chip *chip = user;
    if (number == EXCEPTION_EXIT) chip->has_returned = true;
    else chip->fault = (int)number;
    uc_emu_stop(uc);
}

static uint64_t flash_read(uc_engine *uc, uint64_t offset, unsigned size, void *user) {
    (void)uc;
    Chip *chip = user;
    uint32_t value = 0;
    memcpy(&value, chip->flash + chip->split + offset, size);
    return value;
}

static void flash_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user) {
    (void)uc;
    Chip *chip = user;
    chip->outside.program(chip->split + (uint32_t)offset, size, (uint32_t)value);
}

/* Enter a handler (ARMv7-M manual, B1.5.6).
 *
 * The frame's space on the stack is reserved, but the registers are kept here: a handler cannot read its caller's. */
static void take_exception(Chip *chip) {
    if (get(chip, UC_ARM_REG_PRIMASK) & 1) {
        chip->masked_until_ps = chip->now_ps + MASKED_PS;
        return;
    }
    Nvic *nvic = &chip->nvic;
    int exception = nvic->next, depth = nvic->depth;
    uint32_t vector, table = nvic->vector_table ? nvic->vector_table : FLASH_BASE;
    uint8_t frame[FRAME_SIZE] = {0};
    if (!chip->saved[depth]) uc_context_alloc(chip->uc, &chip->saved[depth]);
    uc_context_save(chip->uc, chip->saved[depth]);
    chip->saved_pc[depth] = chip->pc;
    uint32_t stack = (get(chip, UC_ARM_REG_SP) - FRAME_SIZE) & ~7u;
    uc_mem_write(chip->uc, stack, frame, sizeof frame);
    set(chip, UC_ARM_REG_SP, stack);
    set(chip, UC_ARM_REG_LR, depth ? TO_HANDLER : TO_THREAD);
    set(chip, UC_ARM_REG_XPSR, THUMB_BIT | (uint32_t)exception);
    nvic_enter(chip, exception);
    uc_mem_read(chip->uc, table + 4 * (uint32_t)exception, &vector, sizeof vector);
    chip->pc = vector & ~1u;
}

static void return_from_exception(Chip *chip) {
    nvic_leave(chip);
    uc_context_restore(chip->uc, chip->saved[chip->nvic.depth]);
    chip->pc = chip->saved_pc[chip->nvic.depth];
}

int chip_run(Chip *chip, int64_t end_ns) {
    chip->end_ps = end_ns * PS_PER_NS;
    chip->wants_pause = 0;
    set_pace(chip);
    while (chip->now_ps < chip->end_ps && !chip->wants_pause) {
        if (chip->nvic.next && chip->now_ps >= chip->masked_until_ps) take_exception(chip);
        chip->has_returned = false;
        uc_err error = uc_emu_start(chip->uc, chip->pc | 1, NEVER_REACHED, 0, 0);
        chip->pc = get(chip, UC_ARM_REG_PC);
        if (chip->has_returned && chip->nvic.depth) return_from_exception(chip);
        else if (error || chip->fault) {
            if (chip->fault) snprintf(chip->error, sizeof chip->error, "exception %d at %#010x", chip->fault, chip->pc);
            else snprintf(chip->error, sizeof chip->error, "%s at %#010x", uc_strerror(error), chip->pc);
            return 1;
        }
    }
    return 0;
}

void chip_advance(Chip *chip, int64_t to_ns) { let_pass(chip, to_ns * PS_PER_NS); }

int64_t chip_now_ns(const Chip *chip) { return chip->now_ps / PS_PER_NS; }

uint8_t *chip_ram(Chip *chip) { return chip->ram; }

const char *chip_error(const Chip *chip) { return chip->error; }

/* -- power and reset ----------------------------------------------------------------------------------------- */

void chip_reset(Chip *chip) {
    uint32_t vectors[2];
    chip->wants_reset = chip->is_in_boot_loader = 0;
    chip->fault = 0;
    chip->masked_until_ps = 0;
    bus_reset(chip);
    nvic_reset(chip);
    uc_mem_read(chip->uc, FLASH_BASE, vectors, sizeof vectors);
    set(chip, UC_ARM_REG_XPSR, THUMB_BIT);
    set(chip, UC_ARM_REG_PRIMASK, 0);
    set(chip, UC_ARM_REG_SP, vectors[0]);
    set(chip, UC_ARM_REG_LR, 0xFFFFFFFFu);
    chip->pc = vectors[1] & ~1u;
}

void chip_power_on(Chip *chip, const uint8_t *ram) {
    memcpy(chip->ram, ram, RAM_SIZE);
    chip->ppm_next = 0;
    alarm_in(chip, ALARM_PPM, 20000LL * 1000 * PS_PER_NS);
    chip_reset(chip);
}

void chip_power_off(Chip *chip) {
    bus_reset(chip);
    nvic_reset(chip);
    for (int i = 0; i < 2; i++) usart_power_off(chip, &chip->usart[i]);
    alarm_cancel(chip, ALARM_PPM);
}

static void make_usarts(Chip *chip) {
    Usart *first = &chip->usart[0], *second = &chip->usart[1];
    first->irq = IRQ_USART1, first->receive_dma = 5, first->transmit_dma = 4, first->bus_hz = &chip->apb2_hz;
    first->arrival = ALARM_RECEIVE1, first->departure = ALARM_TRANSMIT1;
    second->irq = IRQ_USART2, second->bus_hz = &chip->apb1_hz;
    second->arrival = ALARM_RECEIVE2, second->departure = ALARM_TRANSMIT2;
}

/* The program's pages can be executed, the rest of the flash can be written. RAM that could be executed would make each
 * store to it slow. */
static bool map(Chip *chip) {
    uc_engine *uc = chip->uc;
    static const uint16_t endless_loop = 0xE7FE;
    const uint32_t boot_vectors[2] = {RAM_BASE + 0x200, BOOT_LOADER_BASE + 0x21};
    uc_hook hook;
    return !(uc_mem_map(uc, FLASH_BASE, chip->split, UC_PROT_READ | UC_PROT_EXEC) ||
             uc_mem_write(uc, FLASH_BASE, chip->flash, chip->split) ||
             (chip->split < FLASH_SIZE && uc_mmio_map(uc, FLASH_BASE + chip->split, FLASH_SIZE - chip->split,
                                                      flash_read, chip, flash_write, chip)) ||
             uc_mem_map_ptr(uc, RAM_BASE, RAM_SIZE, UC_PROT_READ | UC_PROT_WRITE, chip->ram) ||
             uc_mem_map(uc, BOOT_LOADER_BASE, BOOT_LOADER_SIZE, UC_PROT_READ | UC_PROT_EXEC) ||
             uc_mem_write(uc, BOOT_LOADER_BASE, boot_vectors, sizeof boot_vectors) ||
             uc_mem_write(uc, BOOT_LOADER_BASE + 0x20, &endless_loop, sizeof endless_loop) ||
             uc_mmio_map(uc, BUS_BASE, BUS_SIZE, bus_read, chip, bus_write, chip) ||
             uc_mmio_map(uc, 0xE000E000, 0x1000, system_read, chip, system_write, chip) ||
             uc_hook_add(uc, &hook, UC_HOOK_BLOCK, (void *)on_block, chip, 1, 0) ||
             uc_hook_add(uc, &hook, UC_HOOK_INTR, (void *)on_exception, chip, 1, 0));
}

/* `flash` has FLASH_SIZE bytes and stays the caller's. NULL if Unicorn fails. */
Chip *chip_new(uint8_t *flash, uint32_t program_size, const Outside *outside) {
    Chip *chip = aligned_alloc(MAP_PAGE, (sizeof(Chip) + MAP_PAGE - 1) & ~(size_t)(MAP_PAGE - 1));
    if (!chip) return NULL;
    memset(chip, 0, sizeof *chip);
    chip->outside = *outside;
    chip->flash = flash;
    chip->split = (program_size + MAP_PAGE - 1) & ~(MAP_PAGE - 1);
    chip->core_hz = chip->apb1_hz = chip->apb2_hz = 8000000;
    for (int i = 0; i < ALARMS; i++) chip->alarm_ps[i] = NEVER;
    chip->next_ps = NEVER;
    make_usarts(chip);
    chip->timer[0].irq = IRQ_TIM2;
    for (int i = 0; i < PORTS; i++) chip->port[i].outside = 0xFFFF;
    chip->port[2].outside = 0x7FFF; /* with PC15 high the firmware assumes revision 5, with another crystal */
    bus_reset(chip);
    nvic_reset(chip);
    if (uc_open(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, &chip->uc)) chip->uc = NULL;
    if (!chip->uc || uc_ctl_set_cpu_model(chip->uc, UC_CPU_ARM_CORTEX_M3) || !map(chip)) {
        chip_delete(chip);
        return NULL;
    }
    return chip;
}

void chip_delete(Chip *chip) {
    for (int i = 0; i < EXCEPTIONS; i++)
        if (chip->saved[i]) uc_context_free(chip->saved[i]);
    if (chip->uc) uc_close(chip->uc);
    free(chip);
}
