/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chip of a Naze32 (STM32F103CB): state shared by the files of this folder, and the functions that Python calls.
 *
 * Section numbers are those of ST's reference manual RM0008 unless another document is named. Times are picoseconds
 * since the chip was made; they never go back, also while the board has no power.
 */
#ifndef CHIP_H
#define CHIP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <unicorn/unicorn.h>

#define FLASH_BASE 0x08000000u
#define FLASH_SIZE 0x20000u
#define RAM_BASE 0x20000000u
#define RAM_SIZE 0x5000u
#define BOOT_LOADER_BASE 0x1FFFF000u
#define BOOT_LOADER_SIZE 0x1000u
#define BUS_BASE 0x40000000u
#define BUS_SIZE 0x24000u

#define PS_PER_NS 1000
#define PS_PER_S 1000000000000LL
#define NEVER INT64_MAX

/* Interrupt numbers (section 10.1.2). */
enum { IRQ_DMA1_CHANNEL1 = 11, IRQ_TIM2 = 28, IRQ_I2C2_EVENT = 33, IRQ_I2C2_ERROR = 34, IRQ_USART1 = 37, IRQ_USART2 = 38 };

typedef struct Chip Chip;

/* -- alarms.c ------------------------------------------------------------------------------------------------ */

enum alarm {
    ALARM_SYSTICK, ALARM_RECEIVE1, ALARM_RECEIVE2, ALARM_TRANSMIT1, ALARM_TRANSMIT2, ALARM_I2C_START, ALARM_I2C_STOP,
    ALARM_I2C_ADDRESS, ALARM_I2C_SEND, ALARM_I2C_RECEIVE, ALARM_ADC, ALARM_PPM, ALARMS
};

void alarm_in(Chip *chip, enum alarm alarm, int64_t delay_ps);   /* set or move it */
void alarm_cancel(Chip *chip, enum alarm alarm);
bool alarm_is_set(const Chip *chip, enum alarm alarm);
void let_pass(Chip *chip, int64_t to_ps);                        /* let time pass, and alarms go off at their times */

/* The pace of code and of register accesses: see alarms.c. */
void set_pace(Chip *chip);                                      /* after a change of core_hz */
void pace_access(Chip *chip);
void pace_saw(Chip *chip, uint32_t place, uint32_t value);
void pace_look_at_time(Chip *chip);

/* -- nvic.c: interrupts, SysTick and the system control block ------------------------------------------------ */

#define EXCEPTIONS 84
typedef struct {
    uint64_t enabled, pending, lines;
    bool systick_pending;
    uint8_t priority[EXCEPTIONS];
    int active[EXCEPTIONS], depth;
    int next;                                                   /* the exception to take now; 0: none */
    uint32_t priority_group, vector_table;
    uint32_t systick_control, systick_reload;
    bool systick_has_fired;
} Nvic;

void nvic_reset(Chip *chip);
void nvic_line(Chip *chip, int irq, bool is_high);              /* a line pends as long as it is high */
void nvic_enter(Chip *chip, int exception);
void nvic_leave(Chip *chip);
void systick_fire(Chip *chip);
uint64_t system_read(uc_engine *uc, uint64_t offset, unsigned size, void *chip);
void system_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *chip);

/* -- peripherals --------------------------------------------------------------------------------------------- */

#define DMA_CHANNELS 7
typedef struct { uint32_t config, left, size, peripheral, address; } DmaChannel;
typedef struct { uint32_t flags, interrupting; DmaChannel channel[DMA_CHANNELS + 1]; } Dma;   /* channels from 1 */

void dma_reset(Chip *chip);
bool dma_is_ready(const Chip *chip, int number);
void dma_put(Chip *chip, int number, uint32_t value);           /* from a peripheral to memory */
uint32_t dma_take(Chip *chip, int number);                      /* from memory; only if it is ready */
uint32_t dma_read(Chip *chip, uint32_t offset);
void dma_write(Chip *chip, uint32_t offset, uint32_t value);

#define WIRE_SIZE 65536u
typedef struct { uint8_t bytes[WIRE_SIZE]; uint32_t first, count; } Wire;
typedef struct {
    int irq, receive_dma, transmit_dma;                         /* DMA channels; 0: none */
    enum alarm arrival, departure;
    const uint32_t *bus_hz;
    uint32_t status, cr1, cr3, divider, data, baud;
    int shift, holding;                                         /* the byte being sent, and the next one; -1: none */
    Wire rx, tx;
} Usart;

void usart_reset(Chip *chip, Usart *usart);
void usart_power_off(Chip *chip, Usart *usart);
void usart_arrive(Chip *chip, Usart *usart);
void usart_depart(Chip *chip, Usart *usart);
void usart_load(Chip *chip, Usart *usart);
uint32_t usart_read(Chip *chip, Usart *usart, uint32_t offset);
void usart_write(Chip *chip, Usart *usart, uint32_t offset, uint32_t value);

typedef struct {
    uint32_t cr1, cr2, sr1, sr2, ccr, data, address;
    int shift;                                                  /* -1: none */
    bool has_device, will_acknowledge, acknowledged;
} I2c;

void i2c_reset(Chip *chip);
void i2c_alarm(Chip *chip, enum alarm alarm);
uint32_t i2c_read(Chip *chip, uint32_t offset);
void i2c_write(Chip *chip, uint32_t offset, uint32_t value);

#define BLOCK_WORDS 256
#define TIMERS 4                                                /* TIM2, TIM3, TIM4, TIM1 */
typedef struct { uint32_t words[BLOCK_WORDS]; int64_t started_ps; int irq; } Timer;

void timer_reset(Chip *chip, Timer *timer);
void timer_capture(Chip *chip, Timer *timer, int channel);
uint32_t timer_read(Chip *chip, Timer *timer, uint32_t offset);
void timer_write(Chip *chip, Timer *timer, uint32_t offset, uint32_t value);

#define PPM_CHANNELS 8
void ppm_edge(Chip *chip);

#define PORTS 3                                                 /* A, B, C */
typedef struct { uint32_t words[BLOCK_WORDS], outside; } Port;
typedef struct { uint32_t words[BLOCK_WORDS]; } Adc;

void bus_reset(Chip *chip);
void adc_scan(Chip *chip);
uint64_t bus_read(uc_engine *uc, uint64_t offset, unsigned size, void *chip);
void bus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *chip);

/* -- the chip ------------------------------------------------------------------------------------------------ */

/* Handled by Python: blocks that are used rarely, stores into the flash, and the chips on the I2C bus. */
typedef struct {
    uint32_t (*read)(uint32_t offset, uint32_t size);
    void (*write)(uint32_t offset, uint32_t size, uint32_t value);
    void (*program)(uint32_t offset, uint32_t size, uint32_t value);
    bool (*i2c_begin)(uint32_t address, bool is_read);          /* false: no chip has this address */
    uint32_t (*i2c_read)(void);
    void (*i2c_write)(uint32_t byte);
} Outside;

struct Chip {
    /* What Python reads and writes directly: ChipPins in native_chip.py. */
    uint32_t core_hz, apb1_hz, apb2_hz;
    uint32_t receiver_us[PPM_CHANNELS];
    uint32_t battery;                                           /* of the converter, 0 to 4095 */
    uint32_t wants_reset, wants_pause, is_in_boot_loader;
    uint32_t pc;
    uint8_t ram[RAM_SIZE] __attribute__((aligned(4096)));

    Outside outside;
    uint8_t *flash;
    uint32_t split;                                             /* flash below is the program */
    uc_engine *uc;
    int64_t now_ps, next_ps, end_ps;
    int64_t alarm_ps[ALARMS];
    int64_t masked_until_ps, ps_per_byte;
    uc_context *saved[EXCEPTIONS];
    uint32_t saved_pc[EXCEPTIONS];
    bool has_returned;
    int fault;
    char error[80];

    uint32_t seen[2][BUS_SIZE / 4];
    uint32_t nothing_new;

    Nvic nvic;
    Dma dma;
    Usart usart[2];
    I2c i2c;
    Timer timer[TIMERS];
    int ppm_next;
    Port port[PORTS];
    Adc adc;
};

Chip *chip_new(uint8_t *flash, uint32_t program_size, const Outside *outside);
void chip_delete(Chip *chip);
void chip_power_on(Chip *chip, const uint8_t *ram);             /* RAM has arbitrary contents */
void chip_power_off(Chip *chip);
void chip_reset(Chip *chip);                                    /* RAM keeps its contents */
int chip_run(Chip *chip, int64_t end_ns);                       /* 0; 1: the core has crashed, see chip_error */
void chip_advance(Chip *chip, int64_t to_ns);                   /* let time pass while the core does not run */
int64_t chip_now_ns(const Chip *chip);
uint8_t *chip_ram(Chip *chip);
const char *chip_error(const Chip *chip);
void chip_receive(Chip *chip, int usart, const uint8_t *bytes, uint32_t count);
uint32_t chip_take_sent(Chip *chip, int usart, uint8_t *bytes, uint32_t room);
uint32_t chip_baud(const Chip *chip, int usart);
uint32_t chip_timer_register(const Chip *chip, int timer, uint32_t offset);

#endif
