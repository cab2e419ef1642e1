/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A flight controller in memory around the mission core: for the host tests, the emulated Cortex-M3, the fuzzer and, as a
 * shared library, for Python (tests/support/c_core.py).
 *
 * Its flash follows the rules of the STM32F103's: erase works on whole pages and sets every bit; program works on erased
 * half-words, or writes 0000. Anything else is refused and counted in `violations`. The page after the core's represents the
 * configuration and must not change.
 *
 * The power can be cut at any flash operation (an erase of one page, a program of one half-word). The operation is then not
 * done, half done (only some bits changed) or done, and everything but the flash is lost.
 *
 * Around the core is a byte receiver with the patched firmware's rules (INBUF_SIZE, inter-byte timeout).
 */
#ifndef SIM_BOARD_H
#define SIM_BOARD_H

#include "naze_mission.h"

#include <setjmp.h>

#define SIM_CONFIG_OFFSET NM_FLASH_SIZE
#define SIM_FLASH_SIZE (NM_FLASH_SIZE + NM_PAGE_SIZE)
#define SIM_FRAME_SIZE (6u + NM_BUFFER_SIZE)

/* The state of the operation during which the power was cut. */
typedef enum { SIM_CUT_BEFORE, SIM_CUT_WITHIN, SIM_CUT_AFTER } sim_cut_t;

/* How a flash operation fails: reported by the controller, or unreported with an unchanged bit. */
typedef enum { SIM_FAIL_LOUD, SIM_FAIL_SILENT } sim_fail_t;

typedef struct {
    nm_t core;
    uint8_t flash[SIM_FLASH_SIZE];

    uint32_t now_ms;
    uint16_t radius_cm;       /* gps_wp_radius in RAM */
    uint16_t saved_radius_cm; /* ... and in the configuration, written in the next main loop while disarmed */
    bool armed;
    bool write_pending; /* some other write of the configuration is scheduled */

    uint32_t operations; /* flash operations since power-up, sim_cut_at() or sim_fail_at() */
    uint32_t violations; /* of the flash's rules */
    uint32_t erases[NM_PAGES];
    uint32_t cut_at; /* cut the power at this operation; 0: never */
    sim_cut_t cut;
    uint32_t fail_at; /* let this operation fail; 0: none */
    sim_fail_t fail;
    uint32_t random; /* which bits of a half done operation changed */

    uint32_t changes; /* calls of list_changed */
    uint16_t list_count; /* the list in the surrounding firmware's RAM */
    uint8_t list[NM_CAPACITY * NM_RECORD_SIZE];

    uint8_t frame[SIM_FRAME_SIZE]; /* being received */
    uint16_t frame_length;
    uint32_t frame_ms;

    bool powered; /* false after a cut: only sim_power_up() is allowed then */
    jmp_buf lost;
} sim_t;

/* A new board, flash as delivered (erased), configuration page filled, powered up. */
void sim_init(sim_t *s);

/* The same on the heap, for callers in other languages. NULL without memory. */
sim_t *sim_create(void);
void sim_destroy(sim_t *s);

/* Reset: only the flash and the saved gps_wp_radius are kept. */
void sim_power_up(sim_t *s);

/* Count flash operations from 0 again, and cut the power at the `cut_at`th (0: never). */
void sim_cut_at(sim_t *s, uint32_t cut_at, sim_cut_t cut);

/* Count flash operations from 0 again, and let the `fail_at`th fail (0: none). */
void sim_fail_at(sim_t *s, uint32_t fail_at, sim_fail_t fail);

/* nm_handle() with `size` bytes of payload in `buffer`; -1: not a command of the core, -2: the power was cut. */
int sim_request(sim_t *s, uint8_t command, uint8_t *buffer, uint8_t size);

/* nm_store(); -2: the power was cut. */
int sim_store(sim_t *s, const uint8_t *records, uint16_t count);

/* Let time pass, in steps of at most a second with nm_poll() after each. */
void sim_advance(sim_t *s, uint32_t milliseconds);

/* Arm or disarm, and run the main loop once. */
void sim_arm(sim_t *s, bool armed);

/*
 * Receive a byte. Returns the length of the resulting reply frame, written to `reply` (SIM_FRAME_SIZE bytes),
 * 0 if there is none, -2: the power was cut.
 */
int sim_receive(sim_t *s, uint8_t byte, uint8_t *reply);

/* True if the configuration page is as sim_init() filled it. */
bool sim_config_intact(const sim_t *s);

/* For callers without access to the struct. */
void sim_set_write_pending(sim_t *s, bool pending);
uint32_t sim_operations(const sim_t *s);
uint32_t sim_violations(const sim_t *s);
uint32_t sim_changes(const sim_t *s);
uint16_t sim_list(const sim_t *s, uint8_t *records);
uint8_t *sim_flash(sim_t *s);
uint32_t sim_flash_size(void);

#endif
