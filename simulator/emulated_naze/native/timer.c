/* SPDX-License-Identifier: GPL-3.0-or-later
 * General-purpose timers: their counter and an input capture; outputs are only stored (sections 14 and 15). Also the
 * radio receiver on TIM2's channel 1: eight channels on one wire, as times between edges (PPM).
 */
#include "chip.h"
#include <string.h>

enum { CR1 = 0x00, DIER = 0x0C, SR = 0x10, EGR = 0x14, CNT = 0x24, PSC = 0x28, ARR = 0x2C, CCR1 = 0x34 };
/* With failsafe on, the firmware arms only if a frame arrives in each of its 20 ms loops. */
#define PPM_FRAME_US 20000u
#define PPM_SHORTEST_GAP_US 3000u       /* the gap that ends a frame must be longer than any channel */

static void interrupt(Chip *chip, const Timer *timer) {
    if (timer->irq) nvic_line(chip, timer->irq, timer->words[SR / 4] & timer->words[DIER / 4]);
}

/* A timer's clock is twice that of its bus if the bus clock is divided: the core's. */
static uint32_t count(const Chip *chip, const Timer *timer) {
    if (!(timer->words[CR1 / 4] & 1)) return 0;
    uint64_t ticks = (uint64_t)((__int128)(chip->now_ps - timer->started_ps) * chip->core_hz / PS_PER_S);
    return (uint32_t)(ticks / ((uint64_t)timer->words[PSC / 4] + 1) % ((uint64_t)timer->words[ARR / 4] + 1));
}

void timer_reset(Chip *chip, Timer *timer) {
    memset(timer->words, 0, sizeof timer->words);
    timer->words[ARR / 4] = 0xFFFF;
    timer->started_ps = chip->now_ps;
    interrupt(chip, timer);
}

/* An edge on the input of a channel, from 1. */
void timer_capture(Chip *chip, Timer *timer, int channel) {
    timer->words[CCR1 / 4 + channel - 1] = count(chip, timer);
    timer->words[SR / 4] |= 1u << channel;
    interrupt(chip, timer);
}

uint32_t timer_read(Chip *chip, Timer *timer, uint32_t offset) {
    return offset == CNT ? count(chip, timer) : timer->words[offset / 4];
}

/* A flag of the status register is cleared by writing a zero. */
void timer_write(Chip *chip, Timer *timer, uint32_t offset, uint32_t value) {
    if (offset == CNT || (offset == EGR && value & 1)) timer->started_ps = chip->now_ps;
    if (offset == EGR) return;
    timer->words[offset / 4] = offset == SR ? timer->words[SR / 4] & value : value;
    interrupt(chip, timer);
}

uint32_t chip_timer_register(const Chip *chip, int timer, uint32_t offset) { return chip->timer[timer].words[offset / 4]; }

/* Without a transmitter, which is channel 1 at 0, there are no edges. */
void ppm_edge(Chip *chip) {
    if (!chip->receiver_us[0]) {
        chip->ppm_next = 0;
        alarm_in(chip, ALARM_PPM, (int64_t)PPM_FRAME_US * 1000 * PS_PER_NS);
        return;
    }
    timer_capture(chip, &chip->timer[0], 1);
    uint32_t pause_us, sum_us = 0;
    if (chip->ppm_next < PPM_CHANNELS) pause_us = chip->receiver_us[chip->ppm_next];
    else {
        for (int i = 0; i < PPM_CHANNELS; i++) sum_us += chip->receiver_us[i];
        pause_us = sum_us + PPM_SHORTEST_GAP_US < PPM_FRAME_US ? PPM_FRAME_US - sum_us : PPM_SHORTEST_GAP_US;
    }
    chip->ppm_next = (chip->ppm_next + 1) % (PPM_CHANNELS + 1);
    alarm_in(chip, ALARM_PPM, (int64_t)pause_us * 1000 * PS_PER_NS);
}
