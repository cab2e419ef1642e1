/* SPDX-License-Identifier: GPL-3.0-or-later
 * The system control space at 0xE000E000: the interrupt controller, which selects the core's next exception (ARMv7-M
 * manual, B1.5 and B3.4), SysTick (B3.3) and the system control block (B3.2).
 */
#include "chip.h"
#include <string.h>

#define SYSTICK 15
#define FIRST_IRQ 16
#define IRQS (EXCEPTIONS - FIRST_IRQ)
#define PRIORITY_MASK 0xF0u             /* the STM32F103 implements the upper four bits of a priority */

enum { TICK_ENABLE = 1, TICK_INTERRUPT = 2, TICK_CORE_CLOCK = 4, TICK_HAS_FIRED = 1 << 16 };
enum { CLEAR_ENABLE = 0x180, SET_PENDING = 0x200, CLEAR_PENDING = 0x280, PRIORITY = 0x400 };
enum { CPUID = 0xD00, ICSR = 0xD04, VTOR = 0xD08, AIRCR = 0xD0C, HANDLER_PRIORITIES = 0xD18, FIRST_HANDLER = 4 };

/* -- interrupts ---------------------------------------------------------------------------------------------- */

static int group(const Nvic *nvic, int exception) { return nvic->priority[exception] >> (nvic->priority_group + 1); }

/* Find the exception to take now: the most urgent one, if it would preempt the active one. */
static void choose(Nvic *nvic) {
    int candidate = nvic->systick_pending ? SYSTICK : 0;
    for (uint64_t pending = nvic->pending & nvic->enabled; pending; pending &= pending - 1) {
        int exception = FIRST_IRQ + __builtin_ctzll(pending);
        if (!candidate || nvic->priority[exception] < nvic->priority[candidate]) candidate = exception;
    }
    for (int i = 0; candidate && i < nvic->depth; i++)
        if (group(nvic, candidate) >= group(nvic, nvic->active[i])) candidate = 0;
    nvic->next = candidate;
}

void nvic_reset(Chip *chip) {
    memset(&chip->nvic, 0, sizeof chip->nvic);
    alarm_cancel(chip, ALARM_SYSTICK);
}

void nvic_line(Chip *chip, int irq, bool is_high) {
    Nvic *nvic = &chip->nvic;
    uint64_t bit = 1ull << irq;
    if (!is_high) nvic->lines &= ~bit;
    else if (!(nvic->lines & bit)) {
        nvic->lines |= bit;
        nvic->pending |= bit;
        choose(nvic);
    }
}

void nvic_enter(Chip *chip, int exception) {
    Nvic *nvic = &chip->nvic;
    nvic->active[nvic->depth++] = exception;
    if (exception == SYSTICK) nvic->systick_pending = false;
    else nvic->pending &= ~(1ull << (exception - FIRST_IRQ));
    choose(nvic);
}

/* A line that is still high pends again. */
void nvic_leave(Chip *chip) {
    Nvic *nvic = &chip->nvic;
    int exception = nvic->active[--nvic->depth];
    if (exception >= FIRST_IRQ) nvic->pending |= nvic->lines & 1ull << (exception - FIRST_IRQ);
    choose(nvic);
}

static void set_priority(Nvic *nvic, uint32_t exception, uint32_t priority) {
    if (exception < EXCEPTIONS) nvic->priority[exception] = priority & PRIORITY_MASK;
}

static uint32_t priorities(const Nvic *nvic, uint32_t first) {
    uint32_t word = 0;
    for (uint32_t i = 0; i < 4 && first + i < EXCEPTIONS; i++) word |= (uint32_t)nvic->priority[first + i] << 8 * i;
    return word;
}

/* Only the priorities can be read byte by byte. */
static uint32_t nvic_read(const Nvic *nvic, uint32_t offset) {
    if (offset >= PRIORITY) return priorities(nvic, FIRST_IRQ + offset - PRIORITY);
    uint32_t shift = 8 * (offset & 0x7C);
    uint64_t bits = offset < SET_PENDING ? nvic->enabled : nvic->pending;
    return shift < 64 ? (uint32_t)(bits >> shift) : 0;
}

static void nvic_write(Nvic *nvic, uint32_t offset, unsigned size, uint32_t value) {
    uint32_t shift = 8 * (offset & 0x7F);
    uint64_t bits = shift < 64 ? (uint64_t)value << shift : 0;
    if (offset >= PRIORITY)
        for (unsigned i = 0; i < size; i++) set_priority(nvic, FIRST_IRQ + offset - PRIORITY + i, value >> 8 * i);
    else if (offset >= CLEAR_PENDING) nvic->pending &= ~bits;
    else if (offset >= SET_PENDING) nvic->pending |= bits;
    else if (offset >= CLEAR_ENABLE) nvic->enabled &= ~bits;
    else nvic->enabled |= bits;
    choose(nvic);
}

/* -- SysTick ------------------------------------------------------------------------------------------------- */

static int64_t tick_hz(const Chip *chip) {
    return chip->nvic.systick_control & TICK_CORE_CLOCK ? chip->core_hz : chip->core_hz / 8;
}

static void tick_restart(Chip *chip) {
    alarm_in(chip, ALARM_SYSTICK, (int64_t)(chip->nvic.systick_reload + 1) * PS_PER_S / tick_hz(chip));
}

void systick_fire(Chip *chip) {
    tick_restart(chip);
    chip->nvic.systick_has_fired = true;
    if (chip->nvic.systick_control & TICK_INTERRUPT) {
        chip->nvic.systick_pending = true;
        choose(&chip->nvic);
    }
}

static uint32_t tick_read(Chip *chip, uint32_t offset) {
    Nvic *nvic = &chip->nvic;
    uint32_t control;
    int64_t left;
    switch (offset) {
    case 0x10: /* CTRL */
        control = nvic->systick_control | (nvic->systick_has_fired ? TICK_HAS_FIRED : 0);
        nvic->systick_has_fired = false;
        return control;
    case 0x14: /* LOAD */
        return nvic->systick_reload;
    case 0x18: /* VAL */
        pace_look_at_time(chip);
        if (!alarm_is_set(chip, ALARM_SYSTICK)) return 0;
        left = (int64_t)((__int128)(chip->alarm_ps[ALARM_SYSTICK] - chip->now_ps) * tick_hz(chip) / PS_PER_S);
        return left < nvic->systick_reload ? (uint32_t)left : nvic->systick_reload;
    }
    return 0;
}

static void tick_write(Chip *chip, uint32_t offset, uint32_t value) {
    Nvic *nvic = &chip->nvic;
    switch (offset) {
    case 0x10: /* CTRL */
        nvic->systick_control = value & (TICK_ENABLE | TICK_INTERRUPT | TICK_CORE_CLOCK);
        if (!(value & TICK_ENABLE)) alarm_cancel(chip, ALARM_SYSTICK);
        else if (!alarm_is_set(chip, ALARM_SYSTICK)) tick_restart(chip);
        break;
    case 0x14: /* LOAD */
        nvic->systick_reload = value & 0xFFFFFF;
        break;
    case 0x18: /* VAL */
        nvic->systick_has_fired = false;
        if (alarm_is_set(chip, ALARM_SYSTICK)) tick_restart(chip);
    }
}

/* -- the system control block -------------------------------------------------------------------------------- */

static uint32_t system_word(Chip *chip, uint32_t offset) {
    Nvic *nvic = &chip->nvic;
    if (offset >= 0x10 && offset < 0x20) return tick_read(chip, offset);
    if (offset >= 0x100 && offset < 0x500) return nvic_read(nvic, offset);
    if (offset >= HANDLER_PRIORITIES && offset < HANDLER_PRIORITIES + 12)
        return priorities(nvic, FIRST_HANDLER + offset - HANDLER_PRIORITIES);
    switch (offset) {
    case CPUID: return 0x411FC231; /* Cortex-M3 r1p1 */
    case ICSR: return nvic->depth ? (uint32_t)nvic->active[nvic->depth - 1] : 0;
    case VTOR: return nvic->vector_table;
    case AIRCR: return 0xFA05u << 16 | nvic->priority_group << 8;
    }
    return 0;
}

uint64_t system_read(uc_engine *uc, uint64_t offset, unsigned size, void *user) {
    (void)uc;
    uint32_t word = system_word(user, (uint32_t)offset & ~3u) >> 8 * (offset & 3);
    return size < 4 ? word & ((1u << 8 * size) - 1) : word;
}

void system_write(uc_engine *uc, uint64_t at, unsigned size, uint64_t wide, void *user) {
    (void)uc;
    Chip *chip = user;
    Nvic *nvic = &chip->nvic;
    uint32_t offset = (uint32_t)at, value = (uint32_t)wide;
    if (offset >= 0x10 && offset < 0x20) tick_write(chip, offset, value);
    else if (offset >= 0x100 && offset < 0x500) nvic_write(nvic, offset, size, value);
    else if (offset >= HANDLER_PRIORITIES && offset < HANDLER_PRIORITIES + 12)
        for (unsigned i = 0; i < size; i++)
            set_priority(nvic, FIRST_HANDLER + offset - HANDLER_PRIORITIES + i, value >> 8 * i);
    else if (offset == ICSR) {
        if (value & 1 << 26) { /* PENDSTSET */
            nvic->systick_pending = true;
            choose(nvic);
        }
    } else if (offset == VTOR) nvic->vector_table = value;
    else if (offset == AIRCR && value >> 16 == 0x05FA) {
        nvic->priority_group = value >> 8 & 7;
        if (value & 1 << 2) chip->wants_reset = chip->wants_pause = 1; /* SYSRESETREQ */
    }
}
