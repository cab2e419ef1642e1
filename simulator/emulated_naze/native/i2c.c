/* SPDX-License-Identifier: GPL-3.0-or-later
 * The I2C interface as bus master: the events EV5 to EV8 in their order (section 26.3.3).
 */
#include "chip.h"
#include <string.h>

enum { PE = 1, START = 1 << 8, STOP = 1 << 9, ACK = 1 << 10, POS = 1 << 11, SWRST = 1 << 15 };
enum { ERROR_INTERRUPT = 1 << 8, EVENT_INTERRUPT = 1 << 9, BUFFER_INTERRUPT = 1 << 10 };
enum { SB = 1, ADDR = 2, BTF = 4, RXNE = 1 << 6, TXE = 1 << 7, AF = 1 << 10, ERRORS = 0xDF00 };
enum { MASTER = 1, BUSY = 2, TRANSMITTER = 4 };
enum { FAST = 1 << 15, DUTY = 1 << 14 };
#define BITS_PER_BYTE 9

static int64_t bit_ps(const Chip *chip) {   /* section 26.6.8 */
    uint32_t ccr = chip->i2c.ccr, ticks = ccr & 0xFFF ? ccr & 0xFFF : 1;
    ticks *= !(ccr & FAST) ? 2 : ccr & DUTY ? 25 : 3;
    return (int64_t)ticks * PS_PER_S / chip->apb1_hz;
}

static int64_t byte_ps(const Chip *chip) { return BITS_PER_BYTE * bit_ps(chip); }

static void interrupt(Chip *chip) {
    I2c *i2c = &chip->i2c;
    uint32_t events = SB | ADDR | BTF | (i2c->cr2 & BUFFER_INTERRUPT ? RXNE | TXE : 0);
    nvic_line(chip, IRQ_I2C2_EVENT, i2c->cr2 & EVENT_INTERRUPT && i2c->sr1 & events);
    nvic_line(chip, IRQ_I2C2_ERROR, i2c->cr2 & ERROR_INTERRUPT && i2c->sr1 & ERRORS);
}

/* Release the bus. */
void i2c_reset(Chip *chip) {
    memset(&chip->i2c, 0, sizeof chip->i2c);
    chip->i2c.shift = -1;
    chip->i2c.will_acknowledge = chip->i2c.acknowledged = true;
    for (int alarm = ALARM_I2C_START; alarm <= ALARM_I2C_RECEIVE; alarm++) alarm_cancel(chip, (enum alarm)alarm);
    interrupt(chip);
}

/* -- receiving and sending ----------------------------------------------------------------------------------- */

static void receive_next(Chip *chip) {
    /* With POS, ACK is for the byte after the one being received. */
    chip->i2c.will_acknowledge = chip->i2c.cr1 & ACK;
    alarm_in(chip, ALARM_I2C_RECEIVE, byte_ps(chip));
}

static void go_on_receiving(Chip *chip) {
    I2c *i2c = &chip->i2c;
    if (i2c->acknowledged && i2c->sr2 & BUSY && !(i2c->cr1 & STOP)) receive_next(chip);
}

static void byte_received(Chip *chip) {
    I2c *i2c = &chip->i2c;
    int byte = (int)(chip->outside.i2c_read() & 0xFF);
    i2c->acknowledged = i2c->cr1 & POS ? i2c->will_acknowledge : (i2c->cr1 & ACK) != 0;
    if (i2c->sr1 & RXNE) {
        /* The clock is stretched until there is room. */
        i2c->shift = byte;
        i2c->sr1 |= BTF;
    } else {
        i2c->data = (uint32_t)byte;
        i2c->sr1 |= RXNE;
        go_on_receiving(chip);
    }
    if (i2c->cr1 & STOP) {
        alarm_cancel(chip, ALARM_I2C_RECEIVE);
        alarm_in(chip, ALARM_I2C_STOP, bit_ps(chip));
    }
}

static uint32_t read_data(Chip *chip) {
    I2c *i2c = &chip->i2c;
    uint32_t byte = i2c->data;
    i2c->sr1 &= ~(uint32_t)(RXNE | BTF);
    if (i2c->shift >= 0 && !(i2c->sr2 & TRANSMITTER)) {
        i2c->data = (uint32_t)i2c->shift;
        i2c->shift = -1;
        i2c->sr1 |= RXNE;
        go_on_receiving(chip);
    }
    interrupt(chip);
    return byte;
}

static void send(Chip *chip) {
    chip->i2c.shift = (int)chip->i2c.data;
    chip->i2c.sr1 |= TXE;
    alarm_in(chip, ALARM_I2C_SEND, byte_ps(chip));
}

static void byte_sent(Chip *chip) {
    I2c *i2c = &chip->i2c;
    chip->outside.i2c_write((uint32_t)i2c->shift);
    if (i2c->sr1 & TXE) {
        i2c->shift = -1;
        i2c->sr1 |= BTF;
    } else send(chip);
}

static void write_data(Chip *chip, uint32_t byte) {
    I2c *i2c = &chip->i2c;
    if (i2c->sr1 & SB) {
        i2c->sr1 &= ~(uint32_t)SB;
        i2c->address = byte;
        alarm_in(chip, ALARM_I2C_ADDRESS, byte_ps(chip));
    } else if (i2c->sr2 & TRANSMITTER) {
        i2c->sr1 &= ~(uint32_t)BTF;
        i2c->data = byte;
        if (alarm_is_set(chip, ALARM_I2C_SEND)) i2c->sr1 &= ~(uint32_t)TXE;
        else send(chip);
    }
}

/* -- conditions and the address ------------------------------------------------------------------------------ */

static void started(I2c *i2c) {
    i2c->cr1 &= ~(uint32_t)START;
    i2c->sr1 = (i2c->sr1 & ERRORS) | SB;
    i2c->sr2 = MASTER | BUSY;
    i2c->shift = -1;
    i2c->acknowledged = true;
}

static void stopped(Chip *chip) {
    I2c *i2c = &chip->i2c;
    i2c->cr1 &= ~(uint32_t)STOP;
    i2c->sr1 &= ERRORS | RXNE;
    i2c->sr2 = 0;
    alarm_cancel(chip, ALARM_I2C_SEND);
}

static void addressed(Chip *chip) {
    I2c *i2c = &chip->i2c;
    bool is_read = i2c->address & 1;
    if (!chip->outside.i2c_begin(i2c->address >> 1, is_read)) i2c->sr1 |= AF;
    else {
        i2c->sr2 |= is_read ? 0 : TRANSMITTER;
        i2c->sr1 |= ADDR;
    }
}

void i2c_alarm(Chip *chip, enum alarm alarm) {
    switch (alarm) {
    case ALARM_I2C_START: started(&chip->i2c); break;
    case ALARM_I2C_STOP: stopped(chip); break;
    case ALARM_I2C_ADDRESS: addressed(chip); break;
    case ALARM_I2C_SEND: byte_sent(chip); break;
    default: byte_received(chip);
    }
    interrupt(chip);
}

/* -- registers ----------------------------------------------------------------------------------------------- */

/* Reading clears some flags. */
static uint32_t read_sr2(Chip *chip) {
    I2c *i2c = &chip->i2c;
    if (i2c->sr1 & ADDR) {
        i2c->sr1 &= ~(uint32_t)ADDR;
        if (i2c->sr2 & TRANSMITTER) i2c->sr1 |= TXE;
        else receive_next(chip);
        interrupt(chip);
    }
    return i2c->sr2;
}

uint32_t i2c_read(Chip *chip, uint32_t offset) {
    switch (offset) {
    case 0x00: return chip->i2c.cr1;
    case 0x04: return chip->i2c.cr2;
    case 0x10: return read_data(chip);
    case 0x14: return chip->i2c.sr1;
    case 0x18: return read_sr2(chip);
    case 0x1C: return chip->i2c.ccr;
    }
    return 0;
}

static void write_cr1(Chip *chip, uint32_t value) {
    I2c *i2c = &chip->i2c;
    if (value & SWRST) {
        i2c_reset(chip);
        i2c->cr1 = value;
        return;
    }
    uint32_t before = i2c->cr1;
    i2c->cr1 = value;
    if (!(value & PE)) {
        i2c->cr1 &= ~(uint32_t)(START | STOP);
        return;
    }
    if (value & START && !(before & START)) alarm_in(chip, ALARM_I2C_START, bit_ps(chip));
    /* A stop waits for the end of the byte being received, which handles it. */
    if (value & STOP && !(before & STOP) && !alarm_is_set(chip, ALARM_I2C_RECEIVE))
        alarm_in(chip, ALARM_I2C_STOP, bit_ps(chip));
}

void i2c_write(Chip *chip, uint32_t offset, uint32_t value) {
    I2c *i2c = &chip->i2c;
    switch (offset) {
    case 0x00: write_cr1(chip, value); break;
    case 0x04: i2c->cr2 = value; break;
    case 0x10: write_data(chip, value & 0xFF); break;
    case 0x14: i2c->sr1 &= value | ~(uint32_t)ERRORS; break;
    case 0x1C: i2c->ccr = value;
    }
    interrupt(chip);
}
