/* SPDX-License-Identifier: GPL-3.0-or-later
 * A USART: two wires at the speed of its baud rate register, served by the core or by DMA (section 27).
 */
#include "chip.h"

enum { OVERRUN = 1 << 3, RECEIVED = 1 << 5, TRANSMITTED = 1 << 6, EMPTY = 1 << 7 };
enum { RECEIVER = 1 << 2, TRANSMITTER = 1 << 3, RECEIVED_INTERRUPT = 1 << 5, EMPTY_INTERRUPT = 1 << 7, ENABLE = 1 << 13 };
enum { DMA_RECEIVES = 1 << 6, DMA_TRANSMITS = 1 << 7 };
#define BITS_PER_BYTE 10

static void wire_put(Wire *wire, uint8_t byte) {
    if (wire->count < WIRE_SIZE) wire->bytes[(wire->first + wire->count++) % WIRE_SIZE] = byte;
}

static uint8_t wire_take(Wire *wire) {
    uint8_t byte = wire->bytes[wire->first];
    wire->first = (wire->first + 1) % WIRE_SIZE;
    wire->count--;
    return byte;
}

static int64_t byte_ps(const Usart *usart) { return BITS_PER_BYTE * PS_PER_S / usart->baud; }

static void interrupt(Chip *chip, const Usart *usart) {
    bool wanted = (usart->cr1 & RECEIVED_INTERRUPT && usart->status & (RECEIVED | OVERRUN)) ||
                  (usart->cr1 & EMPTY_INTERRUPT && usart->status & EMPTY);
    nvic_line(chip, usart->irq, wanted && usart->cr1 & ENABLE);
}

/* Disable it; bytes on the wire still arrive. */
void usart_reset(Chip *chip, Usart *usart) {
    usart->cr1 = usart->cr3 = usart->divider = usart->data = 0;
    usart->status = TRANSMITTED | EMPTY;
    usart->shift = usart->holding = -1;
    if (!usart->baud) usart->baud = 115200;
    alarm_cancel(chip, usart->departure);
}

/* Drop the bytes on the wires. */
void usart_power_off(Chip *chip, Usart *usart) {
    usart_reset(chip, usart);
    usart->rx.count = usart->tx.count = 0;
    alarm_cancel(chip, usart->arrival);
}

/* A divider rarely gives an exact speed; a receiver tolerates 3 %. */
static void set_baud(Usart *usart) {
    static const uint32_t standard[] = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400};
    if (!usart->divider) return;
    double exact = (double)*usart->bus_hz / usart->divider;
    usart->baud = (uint32_t)(exact + 0.5);
    for (unsigned i = 0; i < sizeof standard / sizeof *standard; i++)
        if (exact > standard[i] * 0.97 && exact < standard[i] * 1.03) usart->baud = standard[i];
    if (!usart->baud) usart->baud = 1;
}

uint32_t usart_read(Chip *chip, Usart *usart, uint32_t offset) {
    switch (offset) {
    case 0x00: return usart->status;
    case 0x04: /* DR */
        usart->status &= ~(RECEIVED | OVERRUN);
        interrupt(chip, usart);
        return usart->data;
    case 0x08: return usart->divider;
    case 0x0C: return usart->cr1;
    case 0x14: return usart->cr3;
    }
    return 0;
}

static void begin(Chip *chip, Usart *usart, int byte) {
    usart->shift = byte;
    usart->status = (usart->status & ~TRANSMITTED) | EMPTY;
    alarm_in(chip, usart->departure, byte_ps(usart));
}

static void send(Chip *chip, Usart *usart, int byte) {
    if (usart->shift < 0) begin(chip, usart, byte);
    else {
        usart->holding = byte;
        usart->status &= ~EMPTY;
    }
}

/* Let the DMA fill the two registers; it is two bytes ahead of the wire. */
void usart_load(Chip *chip, Usart *usart) {
    if (!usart->transmit_dma || !(usart->cr3 & DMA_TRANSMITS && usart->cr1 & ENABLE && usart->cr1 & TRANSMITTER)) return;
    while (usart->holding < 0 && dma_is_ready(chip, usart->transmit_dma))
        send(chip, usart, (int)(dma_take(chip, usart->transmit_dma) & 0xFF));
}

void usart_write(Chip *chip, Usart *usart, uint32_t offset, uint32_t value) {
    switch (offset) {
    case 0x00: usart->status &= value | ~(uint32_t)(RECEIVED | TRANSMITTED); break;
    case 0x04: send(chip, usart, (int)(value & 0xFF)); break;
    case 0x08:
        usart->divider = value;
        set_baud(usart);
        break;
    case 0x0C:
        usart->cr1 = value;
        usart_load(chip, usart);
        break;
    case 0x14:
        usart->cr3 = value;
        usart_load(chip, usart);
    }
    interrupt(chip, usart);
}

void usart_arrive(Chip *chip, Usart *usart) {
    uint8_t byte = wire_take(&usart->rx);
    if (usart->rx.count) alarm_in(chip, usart->arrival, byte_ps(usart));
    if (!(usart->cr1 & ENABLE && usart->cr1 & RECEIVER)) return;
    if (usart->cr3 & DMA_RECEIVES && usart->receive_dma && dma_is_ready(chip, usart->receive_dma)) {
        dma_put(chip, usart->receive_dma, byte);
        return;
    }
    if (usart->status & RECEIVED) usart->status |= OVERRUN;
    else {
        usart->data = byte;
        usart->status |= RECEIVED;
    }
    interrupt(chip, usart);
}

void usart_depart(Chip *chip, Usart *usart) {
    wire_put(&usart->tx, (uint8_t)usart->shift);
    int next = usart->holding;
    usart->shift = usart->holding = -1;
    if (next >= 0) begin(chip, usart, next);
    usart_load(chip, usart);
    if (usart->shift < 0) usart->status |= TRANSMITTED;
    interrupt(chip, usart);
}

/* Put bytes on the RX wire, behind those already there. */
void chip_receive(Chip *chip, int index, const uint8_t *bytes, uint32_t count) {
    Usart *usart = &chip->usart[index];
    for (uint32_t i = 0; i < count; i++) wire_put(&usart->rx, bytes[i]);
    if (usart->rx.count && !alarm_is_set(chip, usart->arrival)) alarm_in(chip, usart->arrival, byte_ps(usart));
}

/* The bytes that have left the TX pin and were not collected yet. */
uint32_t chip_take_sent(Chip *chip, int index, uint8_t *bytes, uint32_t room) {
    Wire *wire = &chip->usart[index].tx;
    uint32_t taken = 0;
    while (taken < room && wire->count) bytes[taken++] = wire_take(wire);
    return taken;
}

uint32_t chip_baud(const Chip *chip, int index) { return chip->usart[index].baud; }
