/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Tests of the mission core on a board in memory. Runs on the host and on an emulated Cortex-M3. */
#include "reference.h"
#include "sim_board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Power cuts are tried at operations 1, 1 + cut_step, ... An emulated CPU is slow: there the step is larger, and the lists
   whose recovery is cut too are shorter. */
#ifdef __arm__
static unsigned cut_step = 5;
enum { NESTED_RECORDS = 1 };
#else
static unsigned cut_step = 1;
enum { NESTED_RECORDS = 8 };
#endif

enum { LOST = -2 };

static sim_t board;
static uint8_t buffer[NM_BUFFER_SIZE];
static unsigned checks, cuts;

#define CHECK(condition) check((condition), #condition, __LINE__)

static void check(bool condition, const char *what, int line)
{
    checks++;
    if (condition)
        return;
    printf("test_mission.c:%d: failed: %s\n", line, what);
    exit(1);
}

/* ---- lists ------------------------------------------------------------------------------------------------------------ */

typedef struct {
    uint16_t count;
    uint32_t checksum;
    uint8_t records[NM_CAPACITY * NM_RECORD_SIZE];
} list_t;

static list_t list_of(uint16_t count, uint8_t seed)
{
    list_t list;
    memset(&list, 0, sizeof list);
    list.count = count;
    for (uint16_t i = 0; i < count * NM_RECORD_SIZE; i++)
        list.records[i] = i % NM_RECORD_SIZE == NM_RECORD_SIZE - 1 ? (uint8_t)(i / NM_RECORD_SIZE % 8)
                                                                  : (uint8_t)(seed + i * 31u + i / 256u);
    list.checksum = bitwise_crc32(list.records, list.count * NM_RECORD_SIZE);
    return list;
}

/* The list, with another byte at `at`. */
static list_t with_byte(const list_t *list, uint16_t at, uint8_t byte)
{
    list_t changed = *list;
    changed.records[at] = byte;
    changed.checksum = bitwise_crc32(changed.records, changed.count * NM_RECORD_SIZE);
    return changed;
}

/* Is the list in flash and in RAM this one, byte for byte? */
static bool holds(const list_t *list)
{
    const nm_t *core = &board.core;
    if (core->stored.count != list->count || core->stored.checksum != list->checksum || board.list_count != list->count)
        return false;
    return list->count == 0 || (!memcmp(nm_records(core), list->records, list->count * NM_RECORD_SIZE) &&
                                !memcmp(board.list, list->records, list->count * NM_RECORD_SIZE));
}

/* ---- requests --------------------------------------------------------------------------------------------------------- */

static uint32_t le(const uint8_t *bytes, int size)
{
    uint32_t value = 0;
    while (size--)
        value = value << 8 | bytes[size];
    return value;
}

static void put(uint8_t *bytes, uint32_t value, int size)
{
    for (int i = 0; i < size; i++)
        bytes[i] = (uint8_t)(value >> 8 * i);
}

/* Send a masked body. Returns the reply's length or -2; the reply is in `buffer`. */
static int request(uint8_t command, const uint8_t *body, uint8_t length)
{
    static uint8_t mask;
    mask = (uint8_t)(mask * 5 + 3);
    buffer[0] = mask;
    for (uint8_t i = 0; i < length; i++)
        buffer[1 + i] = body[i] ^ mask;
    return sim_request(&board, command, buffer, (uint8_t)(length + 1));
}

static int status_of(int reply_length, int expected_length)
{
    if (reply_length == LOST)
        return LOST;
    CHECK(reply_length == expected_length);
    return buffer[0];
}

static int send_list(uint8_t command, uint32_t count, uint32_t crc)
{
    uint8_t body[6];
    put(body, count, 2);
    put(body + 2, crc, 4);
    return status_of(request(command, body, 6), 7);
}

static int begin(const list_t *list)
{
    return send_list(NM_BEGIN, list->count, list->checksum);
}

static int commit(const list_t *list)
{
    return send_list(NM_COMMIT, list->count, list->checksum);
}

static int chunk(const list_t *list, uint16_t first, uint16_t count)
{
    uint8_t body[NM_BUFFER_SIZE];
    const uint16_t bytes = (uint16_t)(count * NM_RECORD_SIZE);
    put(body, first, 2);
    memcpy(body + 2, list->records + first * NM_RECORD_SIZE, bytes);
    return status_of(request(NM_CHUNK, body, (uint8_t)(2 + bytes)), 7);
}

static int radius(uint16_t cm, uint16_t complement)
{
    uint8_t body[4];
    put(body, cm, 2);
    put(body + 2, complement, 2);
    return status_of(request(NM_RADIUS, body, 4), 3);
}

static int read(uint16_t first, uint8_t count)
{
    uint8_t body[4] = {0, 0, 0, 0};
    put(body, first, 2);
    body[2] = count;
    return request(NM_READ, body, 4);
}

static int simple(uint8_t command)
{
    return sim_request(&board, command, buffer, 0);
}

/* A companion's upload: BEGIN, CHUNKs, COMMIT. Returns the last status, or -2. */
static int push(const list_t *list)
{
    int status = begin(list);
    if (status != NM_OK)
        return status;
    for (uint16_t first = 0; first < list->count; first = (uint16_t)(first + NM_CHUNK_RECORDS)) {
        const int left = list->count - first;
        status = chunk(list, first, (uint16_t)(left < (int)NM_CHUNK_RECORDS ? left : (int)NM_CHUNK_RECORDS));
        if (status != NM_OK)
            return status;
    }
    return commit(list);
}

static int store(const list_t *list)
{
    const int status = sim_store(&board, list->records, list->count);
    if (status == NM_OK) {
        memcpy(board.list, list->records, sizeof board.list);
        board.list_count = list->count;
    }
    return status;
}

static bool transfer_open(void)
{
    CHECK(simple(NM_INFO) == 24);
    return buffer[2] & 4;
}

static void fresh_board(const list_t *stored)
{
    sim_init(&board);
    if (stored)
        CHECK(push(stored) == (stored->count ? NM_OK : NM_SAME) && holds(stored));
}

/* A board with `old`, and an earlier full list in the other slot, which must be erased. */
static void used_board(const list_t *old)
{
    const list_t older = list_of(NM_CAPACITY, 99);
    fresh_board(&older);
    CHECK(push(old) == NM_OK && holds(old));
}

/* ---- the protocol ----------------------------------------------------------------------------------------------------- */

static void test_push_and_read_back(void)
{
    const list_t list = list_of(NM_CAPACITY, 3);
    list_t copy = list_of(0, 0);
    fresh_board(NULL);
    CHECK(push(&list) == NM_OK);
    CHECK(le(buffer + 1, 2) == list.count && le(buffer + 3, 4) == list.checksum);
    CHECK(holds(&list) && board.changes == 1);
    for (uint16_t first = 0; first < list.count; first = (uint16_t)(first + NM_READ_RECORDS)) {
        const int length = read(first, 200);
        CHECK(buffer[0] == NM_OK && le(buffer + 1, 2) == first);
        memcpy(copy.records + first * NM_RECORD_SIZE, buffer + 3, (size_t)length - 3);
        copy.count = (uint16_t)(copy.count + (length - 3) / 16);
    }
    CHECK(copy.count == list.count && !memcmp(copy.records, list.records, sizeof copy.records));
    sim_power_up(&board);
    CHECK(holds(&list));
}

static void test_info(void)
{
    const list_t list = list_of(5, 1);
    fresh_board(&list);
    CHECK(begin(&(const list_t){.count = 0}) == NM_OK);
    board.write_pending = true;
    CHECK(simple(NM_INFO) == 24);
    CHECK(buffer[0] == NM_OK && buffer[1] == NM_VERSION && buffer[2] == (2 | 4) && buffer[3] == 15 && buffer[4] == 2 && buffer[5] == 6);
    CHECK(le(buffer + 6, 2) == 146 && le(buffer + 8, 2) == 5 && le(buffer + 10, 4) == list.checksum);
    CHECK(le(buffer + 14, 2) == 200 && le(buffer + 16, 2) == 50 && le(buffer + 18, 2) == 0 && le(buffer + 20, 4) == 1);
    sim_arm(&board, true);
    CHECK(simple(NM_INFO) == 24 && buffer[2] == (1 | 2));
}

static void test_every_request_may_be_repeated(void)
{
    const list_t list = list_of(20, 7), other = list_of(3, 9);
    fresh_board(&other);
    CHECK(begin(&list) == NM_OK && chunk(&list, 0, 15) == NM_OK);
    CHECK(begin(&list) == NM_OK && le(buffer + 1, 2) == 15);
    CHECK(le(buffer + 3, 4) == bitwise_crc32(list.records, 15 * NM_RECORD_SIZE));
    const uint32_t before = board.operations;
    CHECK(chunk(&list, 0, 15) == NM_OK && le(buffer + 1, 2) == 15);
    CHECK(chunk(&list, 10, 10) == NM_OK && le(buffer + 1, 2) == 15);
    CHECK(board.operations == before);
    CHECK(chunk(&list, 15, 5) == NM_OK && commit(&list) == NM_OK && commit(&list) == NM_OK);
    CHECK(simple(NM_ABORT) == 1 && buffer[0] == NM_OK);
    CHECK(holds(&list) && board.changes == 2);
}

static void test_a_stored_list_is_not_written_again(void)
{
    const list_t list = list_of(30, 5), empty = list_of(0, 0);
    fresh_board(NULL);
    sim_cut_at(&board, 0, SIM_CUT_BEFORE);
    CHECK(push(&empty) == NM_SAME && store(&empty) == NM_SAME && board.operations == 0);
    CHECK(push(&list) == NM_OK);
    sim_power_up(&board);
    CHECK(push(&list) == NM_SAME && store(&list) == NM_SAME && board.operations == 0);
    CHECK(push(&empty) == NM_OK && holds(&empty));
    sim_power_up(&board);
    CHECK(holds(&empty) && push(&empty) == NM_SAME && board.operations == 0);
}

static void test_slots_take_turns(void)
{
    fresh_board(NULL);
    for (uint8_t turn = 0; turn < 20; turn++) {
        const list_t list = list_of((uint16_t)(turn % 5), turn);
        CHECK((turn % 2 ? push(&list) : store(&list)) == (turn == 0 ? NM_SAME : NM_OK));
    }
    /* Short lists use a slot's first page only, and each slot's first list found it blank. */
    for (uint8_t page = 0; page < NM_PAGES; page++)
        CHECK(board.erases[page] == (page == 0 ? 9 : page == 3 ? 8 : 0));
    CHECK(board.core.sequence == 19);
}

static unsigned all_erases(void)
{
    unsigned sum = 0;
    for (uint8_t page = 0; page < NM_PAGES; page++)
        sum += board.erases[page];
    return sum;
}

static void test_blank_pages_are_not_erased(void)
{
    const list_t full = list_of(NM_CAPACITY, 1), list = list_of(20, 2);
    fresh_board(NULL);
    CHECK(begin(&full) == NM_OK && begin(&list) == NM_OK && begin(&full) == NM_OK && all_erases() == 0);
    CHECK(chunk(&full, 0, 1) == NM_OK && begin(&list) == NM_OK && all_erases() == 1);
    board.flash[3 * NM_PAGE_SIZE - 1] = 0; /* the slot's last byte, as a torn erase may leave it */
    CHECK(begin(&full) == NM_OK && board.erases[0] == 1 && board.erases[1] == 0 && board.erases[2] == 1);
    CHECK(push(&full) == NM_OK && holds(&full) && all_erases() == 2);
}

/* Repeated BEGIN and CHUNK: each BEGIN finds a slot that is not blank. */
static unsigned begins_until_busy(const list_t *list)
{
    for (unsigned count = 0;; count++) {
        const int status = send_list(NM_BEGIN, list->count, count);
        if (status != NM_OK) {
            CHECK(status == NM_BUSY);
            return count;
        }
        CHECK(chunk(list, 0, 1) == NM_OK);
    }
}

static void test_a_loop_of_requests_cannot_wear_out_the_flash(void)
{
    const list_t old = list_of(4, 1), list = list_of(20, 2);
    fresh_board(&old);
    CHECK(begins_until_busy(&list) == 251 && all_erases() == 250); /* the first one: blank */
    CHECK(simple(NM_INFO) == 24 && buffer[2] == 8);
    CHECK(radius(300, 300 ^ 0xFFFF) == NM_BUSY && board.radius_cm == 200 && begin(&old) == NM_SAME);
    CHECK(chunk(&list, 0, 1) == NM_NO_TRANSFER && holds(&old));

    sim_advance(&board, 300000);
    CHECK(simple(NM_INFO) == 24 && buffer[2] == 0);
    CHECK(radius(300, 300 ^ 0xFFFF) == NM_OK && simple(NM_INFO) == 24 && buffer[2] == (2 | 8));
    sim_advance(&board, 300000);
    CHECK(push(&list) == NM_OK && holds(&list)); /* a list that uses the last write is written completely */
    CHECK(begin(&old) == NM_BUSY && store(&old) == NM_OK && holds(&old)); /* the firmware's own save always goes through */

    sim_advance(&board, 900000);
    CHECK(begins_until_busy(&list) == 3);
    sim_advance(&board, 300000000);
    CHECK(begins_until_busy(&list) == 250);
    sim_power_up(&board);
    CHECK(begins_until_busy(&list) == 250);
}

static void test_a_sequence_wraps(void)
{
    const list_t old = list_of(2, 1), new = list_of(3, 2);
    fresh_board(&old);
    /* rewrite the slot's header as the 2^32-1st list's */
    uint8_t *header = board.flash;
    put(header + 4, 0xFFFFFFFFu, 4);
    put(header + 12, bitwise_crc32(header, 12), 4);
    sim_power_up(&board);
    CHECK(holds(&old) && push(&new) == NM_OK);
    sim_power_up(&board);
    CHECK(holds(&new) && board.core.sequence == 0);
}

static void test_malformed_requests(void)
{
    const list_t old = list_of(4, 1), list = list_of(20, 2);
    uint8_t body[NM_BUFFER_SIZE] = {0};
    fresh_board(&old);
    CHECK(begin(&list) == NM_OK && chunk(&list, 0, 1) == NM_OK);
    for (unsigned size = 0; size <= NM_BUFFER_SIZE; size++) {
        for (uint8_t command = NM_BEGIN; command <= NM_RADIUS; command++) {
            const bool good = command == NM_ABORT                          ? size == 0
                              : command == NM_CHUNK                        ? size > 3 && (size - 3) % 16 == 0
                              : command == NM_BEGIN || command == NM_COMMIT ? size == 7
                                                                            : size == 5;
            if (good)
                continue;
            memset(buffer, 0, sizeof buffer);
            const int length = sim_request(&board, command, buffer, (uint8_t)size);
            CHECK(length == (command == NM_ABORT ? 1 : command >= NM_READ ? 3 : 7) && buffer[0] == NM_BAD_REQUEST);
        }
    }
    CHECK(send_list(NM_BEGIN, 0, 1) == NM_BAD_REQUEST);
    CHECK(radius(300, 300) == NM_BAD_REQUEST && board.radius_cm == 200);
    CHECK(read(0, 0) == 3 && buffer[0] == NM_BAD_REQUEST);
    body[2] = 1;
    body[3] = 1;
    CHECK(request(NM_READ, body, 4) == 3 && buffer[0] == NM_BAD_REQUEST);
    memset(buffer, 7, sizeof buffer);
    for (unsigned command = 0; command <= 255; command++)
        if (command < NM_INFO || command > NM_RADIUS)
            CHECK(sim_request(&board, (uint8_t)command, buffer, 243) == -1 && buffer[1] == 7);
    CHECK(holds(&old));
}

static void test_refusals(void)
{
    const list_t old = list_of(4, 1), list = list_of(20, 2), bad = with_byte(&list, 16 * 3 + 15, 8);
    fresh_board(&old);
    CHECK(chunk(&list, 0, 1) == NM_NO_TRANSFER && commit(&list) == NM_NO_TRANSFER && commit(&old) == NM_OK);
    CHECK(send_list(NM_BEGIN, 147, 5) == NM_NO_SPACE && send_list(NM_BEGIN, 0xFFFF, 5) == NM_NO_SPACE);
    CHECK(begin(&list) == NM_OK);
    CHECK(chunk(&list, 1, 1) == NM_SEQUENCE && le(buffer + 1, 2) == 0);
    CHECK(chunk(&list, 0, 15) == NM_OK && commit(&list) == NM_INCOMPLETE && transfer_open());
    CHECK(chunk(&list, 15, 6) == NM_RANGE && transfer_open()); /* one more than announced */
    CHECK(send_list(NM_COMMIT, 15, bitwise_crc32(list.records, 240)) == NM_INCOMPLETE);
    CHECK(chunk(&list, 15, 5) == NM_OK);
    CHECK(send_list(NM_COMMIT, 20, 1) == NM_CHECKSUM && !transfer_open());
    CHECK(begin(&bad) == NM_OK && chunk(&bad, 0, 15) == NM_BAD_RECORD && !transfer_open());
    CHECK(send_list(NM_BEGIN, 20, 99) == NM_OK && chunk(&list, 0, 15) == NM_OK && chunk(&list, 15, 5) == NM_OK);
    CHECK(send_list(NM_COMMIT, 20, 99) == NM_CHECKSUM && !transfer_open());
    CHECK(read(4, 1) == 3 && buffer[0] == NM_RANGE && read(3, 6) == 3 + 16);
    CHECK(radius(2001, 2001 ^ 0xFFFF) == NM_RANGE && radius(2000, 2000 ^ 0xFFFF) == NM_OK && board.radius_cm == 2000);
    CHECK(holds(&old));
    sim_power_up(&board);
    CHECK(holds(&old));
}

static void test_armed(void)
{
    const list_t old = list_of(4, 1), list = list_of(20, 2);
    fresh_board(&old);
    CHECK(begin(&list) == NM_OK && chunk(&list, 0, 15) == NM_OK);
    sim_arm(&board, true);
    const uint32_t before = board.operations;
    CHECK(!transfer_open() && chunk(&list, 15, 5) == NM_ARMED && begin(&list) == NM_ARMED && commit(&old) == NM_ARMED);
    CHECK(radius(300, 300 ^ 0xFFFF) == NM_ARMED && le(buffer + 1, 2) == 200 && store(&list) == NM_ARMED);
    CHECK(read(0, 6) == 3 + 4 * 16 && buffer[0] == NM_OK);
    /* In flight COMMIT replies from RAM: it does not read 2 KB of flash for a checksum. */
    board.flash[NM_RECORDS_OFFSET] ^= 1;
    CHECK(commit(&old) == NM_ARMED && le(buffer + 1, 2) == 4 && le(buffer + 3, 4) == old.checksum);
    board.flash[NM_RECORDS_OFFSET] ^= 1;
    sim_arm(&board, false);
    CHECK(chunk(&list, 15, 5) == NM_NO_TRANSFER && board.operations == before && holds(&old));
}

static void test_busy(void)
{
    const list_t old = list_of(4, 1), list = list_of(20, 2);
    fresh_board(&old);
    CHECK(begin(&list) == NM_OK && chunk(&list, 0, 15) == NM_OK);
    board.write_pending = true;
    CHECK(chunk(&list, 15, 5) == NM_BUSY && commit(&list) == NM_BUSY && begin(&list) == NM_BUSY && transfer_open());
    CHECK(radius(300, 300 ^ 0xFFFF) == NM_BUSY && radius(200, 200 ^ 0xFFFF) == NM_OK);
    board.write_pending = false;
    CHECK(chunk(&list, 15, 5) == NM_OK && commit(&list) == NM_OK && holds(&list));
}

static void test_a_silent_transfer_is_dropped(void)
{
    const list_t list = list_of(20, 2);
    fresh_board(NULL);
    board.now_ms = 0xFFFFF000u; /* the counter wraps during the test */
    CHECK(begin(&list) == NM_OK);
    sim_advance(&board, 5000);
    CHECK(chunk(&list, 0, 15) == NM_OK);
    sim_advance(&board, 5000);
    CHECK(read(0, 1) == 3 && transfer_open());
    sim_advance(&board, 1);
    CHECK(!transfer_open() && chunk(&list, 15, 5) == NM_NO_TRANSFER);
}

static void test_flash_failures_leave_the_old_list(void)
{
    const list_t old = list_of(40, 1), list = list_of(33, 2);
    for (sim_fail_t fail = SIM_FAIL_LOUD; fail <= SIM_FAIL_SILENT; fail++) {
        for (uint32_t at = 1;; at += cut_step) {
            used_board(&old);
            sim_fail_at(&board, at, fail);
            const int status = push(&list);
            if (board.operations < at)
                break;
            CHECK(status == NM_FLASH && !transfer_open() && holds(&old));
            sim_power_up(&board);
            CHECK(holds(&old) && sim_config_intact(&board));
            used_board(&old);
            sim_fail_at(&board, at, fail);
            CHECK(store(&list) == NM_FLASH && holds(&old));
            sim_fail_at(&board, 0, fail);
            CHECK(push(&list) == NM_OK && holds(&list));
        }
    }
}

static void test_damaged_flash_is_noticed(void)
{
    const list_t old = list_of(10, 1), list = list_of(12, 2);
    fresh_board(&old);
    CHECK(push(&list) == NM_OK);
    board.flash[NM_SLOT_SIZE + NM_RECORDS_OFFSET + 5] ^= 4;
    CHECK(commit(&list) == NM_NO_TRANSFER && le(buffer + 3, 4) != list.checksum);
    sim_power_up(&board);
    CHECK(holds(&old));
    CHECK(push(&list) == NM_OK && holds(&list));
}

/* ---- frames ----------------------------------------------------------------------------------------------------------- */

static int receive(const uint8_t *bytes, int length, uint8_t *reply)
{
    int replied = 0;
    while (length--) {
        const int now = sim_receive(&board, *bytes++, reply);
        if (now)
            replied = now;
    }
    return replied;
}

static void test_a_truncated_frame_is_dropped(void)
{
    static const uint8_t info[6] = {'$', 'M', '<', 0, 190, 190};
    uint8_t reply[SIM_FRAME_SIZE];
    fresh_board(NULL);
    CHECK(receive(info, 6, reply) == 30 && reply[3] == 24 && reply[4] == 190);
    CHECK(receive((const uint8_t *)"$M<\xC8", 4, reply) == 0);
    sim_advance(&board, NM_BYTE_TIMEOUT_MS);
    CHECK(receive(info, 6, reply) == 30);
    CHECK(receive((const uint8_t *)"$M<\x00\x64\x64", 6, reply) == 6 && !memcmp(reply, "$M!\x00\x64\x64", 6));
}

/* ---- power cuts ------------------------------------------------------------------------------------------------------- */

typedef int (*act_t)(const list_t *list);

static int recover(const list_t *list)
{
    const int status = push(list);
    return status == NM_SAME ? NM_OK : status;
}

/* After a cut: the board starts with the complete `old` or `new`, and an unchanged configuration. */
static void check_whole(const list_t *old, const list_t *new)
{
    cuts++;
    sim_power_up(&board);
    CHECK((old ? holds(old) : board.core.stored.count == 0) || holds(new));
    CHECK(sim_config_intact(&board) && board.violations == 0);
}

/* Cut `act` at its operations, each in three ways; with `again`, cut the recovery at its operations too. */
static void cut_everywhere(const list_t *old, const list_t *new, act_t act, bool again)
{
    static sim_t start, recovering;
    if (old)
        used_board(old);
    else
        fresh_board(NULL);
    start = board;
    for (uint32_t at = 1;; at += cut_step) {
        for (int cut = SIM_CUT_BEFORE; cut <= SIM_CUT_AFTER; cut++) {
            board = start;
            board.random = at;
            sim_cut_at(&board, at, (sim_cut_t)cut);
            if (act(new) != LOST)
                return;
            check_whole(old, new);
            recovering = board;
            for (uint32_t next = 1; again; next += cut_step) {
                bool lost = false;
                for (int second = SIM_CUT_BEFORE; second <= SIM_CUT_AFTER; second++) {
                    board = recovering;
                    sim_cut_at(&board, next, (sim_cut_t)second);
                    if (recover(new) != LOST)
                        break;
                    lost = true;
                    check_whole(old, new);
                }
                if (!lost)
                    break;
            }
            board = recovering;
            CHECK(recover(new) == NM_OK && holds(new));
            sim_power_up(&board);
            CHECK(holds(new));
        }
    }
}

static int push_twice(const list_t *list)
{
    const list_t first = with_byte(list, 0, list->records[0] ^ 1);
    const int status = push(&first);
    return status == NM_OK ? push(list) : status;
}

static void cut_scenarios(uint16_t records, bool again)
{
    const list_t none = list_of(0, 0), old = list_of((uint16_t)(records - 1), 77), new = list_of(records, 11);
    cut_everywhere(NULL, &new, push, again); /* as delivered */
    cut_everywhere(&none, &new, push, again);
    cut_everywhere(&old, &new, push, again);
    cut_everywhere(&old, &none, push, again);
    cut_everywhere(&old, &new, store, again);
    cut_everywhere(&old, &none, store, again);
}

/* With three lists: after a cut the old one, the first pushed or the second is stored. */
static void cut_repeated_push(uint16_t records)
{
    const list_t old = list_of((uint16_t)(records - 1), 77), second = list_of(records, 11);
    const list_t first = with_byte(&second, 0, second.records[0] ^ 1);
    for (uint32_t at = 1;; at += cut_step) {
        for (int cut = SIM_CUT_BEFORE; cut <= SIM_CUT_AFTER; cut++) {
            fresh_board(&old);
            sim_cut_at(&board, at, (sim_cut_t)cut);
            if (push_twice(&second) != LOST)
                return;
            cuts++;
            sim_power_up(&board);
            CHECK(holds(&old) || holds(&first) || holds(&second));
            CHECK(sim_config_intact(&board) && board.violations == 0);
            CHECK(recover(&second) == NM_OK && holds(&second));
        }
    }
}

static void test_power_cuts(void)
{
    cut_scenarios(NM_CAPACITY, false);
    cut_repeated_push(NM_CAPACITY);
    printf("  power cut before, within and after each flash operation of push, clear, repeated push and the firmware's own\n"
           "  save, in steps of %u, %u records: %u of %u left the whole old or the whole new list\n",
           cut_step, NM_CAPACITY, cuts, cuts);
    cuts = 0;
    cut_scenarios(NESTED_RECORDS, true);
    cut_repeated_push(NESTED_RECORDS);
    printf("  and at each operation of the recovery again, in steps of %u, %d records: %u of %u\n",
           cut_step, NESTED_RECORDS, cuts, cuts);
}

/* ---- stack (on the emulated Cortex-M3) -------------------------------------------------------------------------------- */

#ifdef __arm__
enum { PAINTED = 2048, PAINT = 0xA5 };

/* The stack used below this function's frame to handle a request: paint, call, inspect. */
__attribute__((noinline)) static unsigned stack_of(uint8_t command, uint8_t size)
{
    volatile uint8_t *const frame = __builtin_frame_address(0);
    volatile uint8_t *low = frame - PAINTED;
    for (int i = 8; i <= PAINTED; i++)
        frame[-i] = PAINT;
    (void)nm_handle(&board.core, command, buffer, size);
    while (*low == PAINT)
        low++;
    return (unsigned)(frame - low);
}

static void measure_stack(void)
{
    static const uint8_t sizes[] = {0, 7, 243, 7, 0, 5, 5};
    const list_t list = list_of(15, 1);
    unsigned most = 0;
    fresh_board(NULL);
    for (uint8_t i = 0; i < sizeof sizes; i++) {
        buffer[0] = 0;
        put(buffer + 1, i == 2 ? 0 : i == 5 ? 0 : i == 6 ? 300 : list.count, 2);
        if (i == 2)
            memcpy(buffer + 3, list.records, sizeof list.records < 240 ? sizeof list.records : 240);
        else if (i == 5)
            put(buffer + 3, 6, 2);
        else
            put(buffer + 3, i == 6 ? 300 ^ 0xFFFF : list.checksum, i == 6 ? 2 : 4);
        const unsigned stack = stack_of((uint8_t)(NM_INFO + i), sizes[i]);
        CHECK(buffer[0] == NM_OK);
        most = stack > most ? stack : most;
    }
    printf("  stack below the caller of nm_handle(), the simulated board's functions included: %u bytes at most\n", most);
    CHECK(most <= 256);
}
#endif

/* Arguments: cut_step. */
int main(int argc, char **argv)
{
    static void (*const tests[])(void) = {
        test_push_and_read_back,
        test_info,
        test_every_request_may_be_repeated,
        test_a_stored_list_is_not_written_again,
        test_slots_take_turns,
        test_blank_pages_are_not_erased,
        test_a_loop_of_requests_cannot_wear_out_the_flash,
        test_a_sequence_wraps,
        test_malformed_requests,
        test_refusals,
        test_armed,
        test_busy,
        test_a_silent_transfer_is_dropped,
        test_flash_failures_leave_the_old_list,
        test_damaged_flash_is_noticed,
        test_a_truncated_frame_is_dropped,
        test_power_cuts,
    };
    if (argc > 1)
        cut_step = (unsigned)atoi(argv[1]);
    CHECK(cut_step >= 1);
    for (unsigned i = 0; i < sizeof tests / sizeof *tests; i++)
        tests[i]();
#ifdef __arm__
    measure_stack();
#endif
    printf("  %u tests, %u checks passed\n", (unsigned)(sizeof tests / sizeof *tests), checks);
    return 0;
}
