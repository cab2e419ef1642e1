/* SPDX-License-Identifier: GPL-3.0-or-later
 * The peripheral bus: the register block at each address (section 3.3, memory map); also the simple ones: pins
 * (section 9.2) and the analog-digital converter in continuous mode with DMA, which measures the battery (section 11).
 */
#include "chip.h"
#include <string.h>

enum { TIM2 = 0x00000, TIM3 = 0x00400, TIM4 = 0x00800, USART2 = 0x04400, I2C2 = 0x05800, PORT_A = 0x10800,
       PORT_B = 0x10C00, PORT_C = 0x11000, ADC1 = 0x12400, TIM1 = 0x12C00, USART1 = 0x13800, DMA1 = 0x20000 };
enum { CRL = 0x00, CRH = 0x04, IDR = 0x08, ODR = 0x0C, BSRR = 0x10, BRR = 0x14 };
enum { ADC_SR = 0x00, ADC_CR2 = 0x08, ADC_SQR1 = 0x2C, ADC_DR = 0x4C };
enum { ADC_ON = 1, ADC_CONTINUOUS = 2, ADC_CALIBRATE = 4, ADC_RESET_CALIBRATION = 8, ADC_DMA = 1 << 8, ADC_START = 1 << 22 };
#define ALL_FLOATING 0x44444444u
/* Far slower than the real converter, to save CPU time: the firmware reads only the latest value. */
#define ADC_SCAN_PS (1000000LL * PS_PER_NS)

static uint32_t port_read(const Port *port, uint32_t offset) {
    if (offset != IDR) return port->words[offset / 4];
    uint64_t modes = (uint64_t)port->words[CRH / 4] << 32 | port->words[CRL / 4];
    uint32_t outputs = 0;
    for (int pin = 0; pin < 16; pin++) outputs |= (modes >> 4 * pin & 3 ? 1u : 0u) << pin;
    return (port->words[ODR / 4] & outputs) | (port->outside & ~outputs);
}

static void port_write(Port *port, uint32_t offset, uint32_t value) {
    uint32_t *output = &port->words[ODR / 4];
    if (offset == BSRR) *output = (*output & ~(value >> 16)) | (value & 0xFFFF);
    else if (offset == BRR) *output &= ~value;
    else port->words[offset / 4] = value;
}

static void adc_write(Chip *chip, uint32_t offset, uint32_t value) {
    if (offset == ADC_CR2) {
        if (value & ADC_ON && value & ADC_START && !alarm_is_set(chip, ALARM_ADC)) alarm_in(chip, ALARM_ADC, ADC_SCAN_PS);
        value &= ~(uint32_t)(ADC_CALIBRATE | ADC_RESET_CALIBRATION | ADC_START); /* calibrations take no time */
    }
    chip->adc.words[offset / 4] = value;
}

void adc_scan(Chip *chip) {
    uint32_t *words = chip->adc.words, control = words[ADC_CR2 / 4];
    for (uint32_t i = 0; i <= (words[ADC_SQR1 / 4] >> 20 & 15); i++) {
        words[ADC_DR / 4] = chip->battery;
        if (control & ADC_DMA) dma_put(chip, 1, chip->battery);
    }
    words[ADC_SR / 4] |= 2; /* EOC */
    if (control & ADC_CONTINUOUS && control & ADC_ON) alarm_in(chip, ALARM_ADC, ADC_SCAN_PS);
}

void bus_reset(Chip *chip) {
    for (int i = 0; i < PORTS; i++) {
        memset(chip->port[i].words, 0, sizeof chip->port[i].words);
        chip->port[i].words[CRL / 4] = chip->port[i].words[CRH / 4] = ALL_FLOATING;
    }
    memset(&chip->adc, 0, sizeof chip->adc);
    alarm_cancel(chip, ALARM_ADC);
    for (int i = 0; i < TIMERS; i++) timer_reset(chip, &chip->timer[i]);
    for (int i = 0; i < 2; i++) usart_reset(chip, &chip->usart[i]);
    dma_reset(chip);
    i2c_reset(chip);
}

uint64_t bus_read(uc_engine *uc, uint64_t at, unsigned size, void *user) {
    (void)uc;
    Chip *chip = user;
    uint32_t place = (uint32_t)at, offset = place & 0x3FC, value;
    pace_access(chip);
    switch (place & ~0x3FFu) {
    case TIM2: value = timer_read(chip, &chip->timer[0], offset); break;
    case TIM3: value = timer_read(chip, &chip->timer[1], offset); break;
    case TIM4: value = timer_read(chip, &chip->timer[2], offset); break;
    case TIM1: value = timer_read(chip, &chip->timer[3], offset); break;
    case USART1: value = usart_read(chip, &chip->usart[0], offset); break;
    case USART2: value = usart_read(chip, &chip->usart[1], offset); break;
    case I2C2: value = i2c_read(chip, offset); break;
    case PORT_A: value = port_read(&chip->port[0], offset); break;
    case PORT_B: value = port_read(&chip->port[1], offset); break;
    case PORT_C: value = port_read(&chip->port[2], offset); break;
    case ADC1: value = chip->adc.words[offset / 4]; break;
    case DMA1: value = dma_read(chip, offset); break;
    default: value = chip->outside.read(place & ~3u, size);
    }
    value >>= 8 * (place & 3);
    if (size < 4) value &= (1u << 8 * size) - 1;
    pace_saw(chip, place, value);
    return value;
}

/* The chip copies a short store to the rest of the word, which no register uses. */
void bus_write(uc_engine *uc, uint64_t at, unsigned size, uint64_t wide, void *user) {
    (void)uc;
    Chip *chip = user;
    uint32_t place = (uint32_t)at, offset = place & 0x3FC, value = (uint32_t)wide << 8 * (place & 3);
    pace_access(chip);
    pace_saw(chip, BUS_SIZE + place, (uint32_t)wide);
    switch (place & ~0x3FFu) {
    case TIM2: timer_write(chip, &chip->timer[0], offset, value); break;
    case TIM3: timer_write(chip, &chip->timer[1], offset, value); break;
    case TIM4: timer_write(chip, &chip->timer[2], offset, value); break;
    case TIM1: timer_write(chip, &chip->timer[3], offset, value); break;
    case USART1: usart_write(chip, &chip->usart[0], offset, value); break;
    case USART2: usart_write(chip, &chip->usart[1], offset, value); break;
    case I2C2: i2c_write(chip, offset, value); break;
    case PORT_A: port_write(&chip->port[0], offset, value); break;
    case PORT_B: port_write(&chip->port[1], offset, value); break;
    case PORT_C: port_write(&chip->port[2], offset, value); break;
    case ADC1: adc_write(chip, offset, value); break;
    case DMA1: dma_write(chip, offset, value); break;
    default:
        chip->outside.write(place & ~3u, size, value);
        set_pace(chip);
    }
}
