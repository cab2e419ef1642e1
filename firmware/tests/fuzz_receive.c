/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Interprets a fuzzer's input as events on a board: a byte for the event, and its operands.
 *
 *   0..15     that many + 1 bytes arrive as they are
 *   16..31    a request arrives: command 190 + (low 3 bits), size byte, masked payload; its checksum is corrected
 *   32..39    time passes: 1, 10, 49, 50, 999, 4999, 5001, 60000 ms
 *   40, 41    disarmed, armed
 *   42, 43    no write scheduled, a write scheduled
 *   44        reset
 *   45 n      power cut within the (n + 1)th flash operation from now on
 *   46 n      failure of the (n + 1)th
 *   47 n      the firmware itself saves a list of n records
 *
 * Always: the flash's rules are kept, the configuration is untouched, the list changes only by a COMMIT or by the firmware,
 * and the stored list has the reported checksum.
 */
#include "reference.h"
#include "sim_board.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    const uint8_t *at;
    const uint8_t *end;
} input_t;

static sim_t board;
static uint8_t reply[SIM_FRAME_SIZE];
static bool may_change; /* true if the current step may change the list */

static void expect(bool condition)
{
    if (!condition)
        abort();
}

static uint8_t next(input_t *in)
{
    return in->at < in->end ? *in->at++ : 0;
}

static void receive(uint8_t byte)
{
    const uint8_t command = board.frame_length > 4 ? board.frame[4] : 0;
    const int length = sim_receive(&board, byte, reply);
    if (length > 0) {
        expect(length == reply[3] + 6 && (unsigned)length <= SIM_FRAME_SIZE);
        may_change = command == NM_COMMIT && reply[5] == NM_OK;
    }
}

static void receive_request(input_t *in, uint8_t command)
{
    const uint8_t size = next(in);
    uint8_t sum = size ^ command;
    const uint8_t head[5] = {'$', 'M', '<', size, command};
    for (int i = 0; i < 5; i++)
        receive(head[i]);
    for (int i = 0; i < size && size <= NM_BUFFER_SIZE; i++) {
        const uint8_t byte = next(in);
        sum ^= byte;
        receive(byte);
    }
    receive(sum);
}

static void happen(input_t *in)
{
    static const uint16_t times[8] = {1, 10, 49, 50, 999, 4999, 5001, 60000};
    static uint8_t records[255 * NM_RECORD_SIZE];
    const uint8_t what = next(in) % 48;
    if (what < 16) {
        for (int i = 0; i <= what; i++)
            receive(next(in));
    } else if (what < 32) {
        receive_request(in, (uint8_t)(NM_INFO + what % 8));
    } else if (what < 40) {
        sim_advance(&board, times[what % 8]);
    } else if (what < 42) {
        sim_arm(&board, what % 2);
    } else if (what < 44) {
        sim_set_write_pending(&board, what % 2);
    } else if (what == 44) {
        sim_power_up(&board);
    } else if (what == 45) {
        sim_cut_at(&board, next(in) + 1u, SIM_CUT_WITHIN);
    } else if (what == 46) {
        sim_fail_at(&board, next(in) + 1u, next(in) % 2 ? SIM_FAIL_SILENT : SIM_FAIL_LOUD);
    } else {
        const uint8_t count = next(in);
        memset(records, count, sizeof records);
        const int status = sim_store(&board, records, count);
        may_change = true;
        if (status == NM_OK) {
            memcpy(board.list, records, count * NM_RECORD_SIZE);
            board.list_count = count;
        }
    }
}

/* The list in flash, the one in RAM, and the checksum that is reported agree; no other flash was touched. */
static void check_stored(void)
{
    const uint8_t *records = nm_records(&board.core);
    const uint32_t bytes = board.core.stored.count * NM_RECORD_SIZE;
    expect(sim_config_intact(&board));
    if (records) {
        expect(bitwise_crc32(records, bytes) == board.core.stored.checksum);
        expect(memcmp(board.list, records, bytes) == 0);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t in = {data, data + size};
    sim_init(&board);
    while (in.at < in.end) {
        const nm_list_t before = board.core.stored;
        const nm_t *core = &board.core;
        const bool had_power = board.powered;
        may_change = false;
        happen(&in);
        if (!board.powered) { /* a cut within COMMIT's last step may have made the new list the stored one, or not */
            may_change = true;
            if (had_power)
                sim_power_up(&board);
        }
        expect(may_change || (before.count == core->stored.count && before.checksum == core->stored.checksum));
        expect(board.violations == 0 && board.list_count == core->stored.count);
        if (may_change || in.at == in.end)
            check_stored();
    }
    return 0;
}
