/* SPDX-License-Identifier: GPL-3.0-or-later
 * The DMA controller's seven channels, for single transfers requested by a peripheral (section 13).
 */
#include "chip.h"
#include <string.h>

enum { ENABLE = 1, COMPLETE_INTERRUPT = 2, HALF_INTERRUPT = 4, CIRCULAR = 1 << 5, MEMORY_INCREMENT = 1 << 7 };
enum { GLOBAL = 1, COMPLETE = 2, HALF = 4 };
enum { ISR = 0, IFCR = 4, FIRST_CHANNEL = 8, CHANNEL_SIZE = 20 };

void dma_reset(Chip *chip) { memset(&chip->dma, 0, sizeof chip->dma); }

bool dma_is_ready(const Chip *chip, int number) {
    const DmaChannel *channel = &chip->dma.channel[number];
    return channel->config & ENABLE && channel->left;
}

static void flag(Chip *chip, int number, uint32_t event, bool interrupts) {
    chip->dma.flags |= (event | GLOBAL) << 4 * (number - 1);
    if (interrupts) {
        chip->dma.interrupting |= event << 4 * (number - 1);
        nvic_line(chip, IRQ_DMA1_CHANNEL1 + number - 1, true);
    }
}

/* The place in RAM or flash of the next transfer; NULL if there is neither. */
static uint8_t *next_place(Chip *chip, const DmaChannel *channel, uint32_t width) {
    uint32_t done = channel->config & MEMORY_INCREMENT ? channel->size - channel->left : 0;
    uint32_t address = channel->address + done * width;
    if (address - RAM_BASE <= RAM_SIZE - width) return chip->ram + (address - RAM_BASE);
    return address - FLASH_BASE <= FLASH_SIZE - width ? chip->flash + (address - FLASH_BASE) : NULL;
}

static uint32_t width_of(const DmaChannel *channel) {
    uint32_t width = 1u << (channel->config >> 10 & 3);
    return width > 4 ? 4 : width;
}

static void count(Chip *chip, int number) {
    DmaChannel *channel = &chip->dma.channel[number];
    channel->left--;
    if (channel->left == channel->size / 2) flag(chip, number, HALF, channel->config & HALF_INTERRUPT);
    if (!channel->left) {
        if (channel->config & CIRCULAR) channel->left = channel->size;
        flag(chip, number, COMPLETE, channel->config & COMPLETE_INTERRUPT);
    }
}

void dma_put(Chip *chip, int number, uint32_t value) {
    DmaChannel *channel = &chip->dma.channel[number];
    if (!dma_is_ready(chip, number)) return;
    uint8_t *place = next_place(chip, channel, width_of(channel));
    if (place >= chip->ram && place < chip->ram + RAM_SIZE) memcpy(place, &value, width_of(channel));
    count(chip, number);
}

uint32_t dma_take(Chip *chip, int number) {
    DmaChannel *channel = &chip->dma.channel[number];
    const uint8_t *place = next_place(chip, channel, width_of(channel));
    uint32_t value = 0;
    if (place) memcpy(&value, place, width_of(channel));
    count(chip, number);
    return value;
}

uint32_t dma_read(Chip *chip, uint32_t offset) {
    if (offset < FIRST_CHANNEL) return offset == ISR ? chip->dma.flags : 0;
    uint32_t index = (offset - FIRST_CHANNEL) / CHANNEL_SIZE;
    if (index >= DMA_CHANNELS) return 0;
    const DmaChannel *channel = &chip->dma.channel[index + 1];
    switch ((offset - FIRST_CHANNEL) % CHANNEL_SIZE) {
    case 0: return channel->config;
    case 4: return channel->left;
    case 8: return channel->peripheral;
    case 12: return channel->address;
    }
    return 0;
}

static void clear(Chip *chip, uint32_t flags) {
    for (int number = 1; number <= DMA_CHANNELS; number++) {
        int shift = 4 * (number - 1);
        uint32_t mask = flags & 0xFu << shift;
        if (mask & GLOBAL << shift) mask = 0xFu << shift;
        chip->dma.flags &= ~mask;
        chip->dma.interrupting &= ~mask;
        if (mask && !(chip->dma.interrupting & 0xFu << shift)) nvic_line(chip, IRQ_DMA1_CHANNEL1 + number - 1, false);
    }
}

/* The number of transfers can be changed only while the channel is disabled. */
void dma_write(Chip *chip, uint32_t offset, uint32_t value) {
    if (offset == IFCR) clear(chip, value);
    uint32_t index = (offset - FIRST_CHANNEL) / CHANNEL_SIZE;
    if (offset < FIRST_CHANNEL || index >= DMA_CHANNELS) return;
    DmaChannel *channel = &chip->dma.channel[index + 1];
    switch ((offset - FIRST_CHANNEL) % CHANNEL_SIZE) {
    case 0:
        channel->config = value;
        for (int i = 0; i < 2; i++)
            if (chip->usart[i].transmit_dma == (int)index + 1) usart_load(chip, &chip->usart[i]);
        break;
    case 4:
        if (!(channel->config & ENABLE)) channel->left = channel->size = value & 0xFFFF;
        break;
    case 8: channel->peripheral = value; break;
    case 12: channel->address = value;
    }
}
