/* SPDX-License-Identifier: GPL-3.0-or-later
 * Time, alarms, and the pace of code and of register accesses.
 *
 * A busy-wait loop reads the time repeatedly while everything else it reads stays the same. After some repetitions each
 * read lets more time pass than the one before, up to the next alarm.
 */
#include "chip.h"

#define ACCESS_PS (40 * PS_PER_NS)      /* wait states of the bus */
#define NORMAL_ACCESSES 24              /* with more accesses than this that change nothing, it is a busy-wait loop */
#define SKIP_PS (500 * PS_PER_NS)
#define LONGEST_SKIP_PS (50000 * PS_PER_NS)

/* The average for the firmware's code, with the flash's two wait states: 1.5 cycles for 2.4 bytes. */
void set_pace(Chip *chip) { chip->ps_per_byte = PS_PER_S * 5 / 8 / chip->core_hz; }

static void find_next(Chip *chip) {
    int64_t next = NEVER;
    for (int i = 0; i < ALARMS; i++)
        if (chip->alarm_ps[i] < next) next = chip->alarm_ps[i];
    chip->next_ps = next;
}

void alarm_in(Chip *chip, enum alarm alarm, int64_t delay_ps) {
    chip->alarm_ps[alarm] = chip->now_ps + delay_ps;
    find_next(chip);
}

void alarm_cancel(Chip *chip, enum alarm alarm) {
    chip->alarm_ps[alarm] = NEVER;
    find_next(chip);
}

bool alarm_is_set(const Chip *chip, enum alarm alarm) { return chip->alarm_ps[alarm] != NEVER; }

static void go_off(Chip *chip, enum alarm alarm) {
    switch (alarm) {
    case ALARM_SYSTICK: systick_fire(chip); break;
    case ALARM_RECEIVE1: usart_arrive(chip, &chip->usart[0]); break;
    case ALARM_RECEIVE2: usart_arrive(chip, &chip->usart[1]); break;
    case ALARM_TRANSMIT1: usart_depart(chip, &chip->usart[0]); break;
    case ALARM_TRANSMIT2: usart_depart(chip, &chip->usart[1]); break;
    case ALARM_ADC: adc_scan(chip); break;
    case ALARM_PPM: ppm_edge(chip); break;
    default: i2c_alarm(chip, alarm);
    }
}

void let_pass(Chip *chip, int64_t to_ps) {
    while (chip->next_ps <= to_ps) {
        int64_t at = chip->next_ps;
        for (int i = 0; i < ALARMS; i++)
            if (chip->alarm_ps[i] == at) {
                if (at > chip->now_ps) chip->now_ps = at;
                chip->alarm_ps[i] = NEVER;
                find_next(chip);
                go_off(chip, (enum alarm)i);
                break;
            }
    }
    if (to_ps > chip->now_ps) chip->now_ps = to_ps;
}

/* An interrupt is taken between blocks of code, so SysTick must not go off within one: code that reads its counter and
 * the number of ticks would find the counter restarted and the tick missing: a time that is 1 ms too early. */
static int64_t before_tick(const Chip *chip, int64_t to_ps) {
    int64_t tick_ps = chip->alarm_ps[ALARM_SYSTICK];
    return to_ps < tick_ps ? to_ps : tick_ps - 1;
}

void pace_access(Chip *chip) { let_pass(chip, before_tick(chip, chip->now_ps + ACCESS_PS)); }

/* Note that the firmware has read (place below BUS_SIZE) or written (BUS_SIZE higher) a value. */
void pace_saw(Chip *chip, uint32_t place, uint32_t value) {
    uint32_t *seen = &chip->seen[place >= BUS_SIZE][place % BUS_SIZE / 4];
    if (*seen == value) chip->nothing_new++;
    else {
        *seen = value;
        chip->nothing_new = 0;
    }
}

/* Note that the firmware is about to read the time. */
void pace_look_at_time(Chip *chip) {
    pace_access(chip);
    if (++chip->nothing_new <= NORMAL_ACCESSES) return;
    int64_t skip_ps = (int64_t)(chip->nothing_new - NORMAL_ACCESSES) * SKIP_PS;
    if (skip_ps > LONGEST_SKIP_PS) skip_ps = LONGEST_SKIP_PS;
    int64_t to_ps = before_tick(chip, chip->now_ps + skip_ps);
    let_pass(chip, to_ps < chip->next_ps ? to_ps : chip->next_ps);
}
