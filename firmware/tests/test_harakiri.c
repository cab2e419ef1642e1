/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Tests of harakiri_guard.c, of harakiri_settings.c, of harakiri_mission.c (the list in cfg, the list in the flash slots and the copy in the
 * configuration) and of harakiri_config.c (power cuts while the configuration is written, and other builds in between). This file stands in for Harakiri: it makes the calls that the patches make.
 */
#include "harakiri_guard.c"
#include "harakiri_mission.c"
#include "harakiri_settings.c"
#include "harakiri/settings_table.h"
#include "harakiri_config.h"
#include "reference.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>

#define FLASH_START 0x08000000u
#define VERSION 34
#define OLD 0x11 /* the byte of a configuration of settings */
#define NEW 0x22
#define FLASH_END (FLASH_WRITE_ADDR + FLASH_PAGES_FORCONFIG * FLASH_PAGE_SIZE)

config_t cfg;
flags_t f;
int16_t rcData[8];
uint32_t ScheduleEEPROMwriteMS;

static uint32_t now;
static bool pass, upload_open, unlocked;
static unsigned config_writes;

static unsigned cut_step = 1; /* power cuts are tried at operations 1, 1 + cut_step, ...; random histories are that much shorter */
static unsigned operations, cut_at; /* flash operations so far, and the one at which the power is cut; 0: never */
static uint32_t seed = 1;
static jmp_buf lost;

#define CHECK(condition) check((condition), #condition, __LINE__)

static void check(bool condition, const char *what, int line)
{
    if (condition)
        return;
    printf("test_harakiri.c:%d: failed: %s\n", line, what);
    exit(1);
}

/* ---- Harakiri --------------------------------------------------------------------------------------------------------- */

static uint8_t *at(uint32_t address)
{
    CHECK(address >= CONFIG_STAGED_ADDR && address < FLASH_END); /* the program must not be written to */
    return (uint8_t *)(uintptr_t)address;
}

void FLASH_Unlock(void)
{
    unlocked = true;
}

void FLASH_Lock(void)
{
    unlocked = false;
}

void FLASH_ClearFlag(uint32_t flags)
{
    (void)flags;
}

static uint32_t random_bits(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return seed;
}

FLASH_Status FLASH_ErasePage(uint32_t address)
{
    uint8_t *page = at(address);
    CHECK(unlocked && address % FLASH_PAGE_SIZE == 0);
    if (++operations == cut_at) {
        const uint32_t kind = random_bits() % 4;
        for (unsigned i = 0; i < FLASH_PAGE_SIZE; i++)
            page[i] = (uint8_t)(page[i] | (kind == 0 ? 0 : kind == 1 ? 0xFF : kind == 2 ? random_bits() : random_bits() % 2 * 0xFF));
        longjmp(lost, 1);
    }
    memset(page, 0xFF, FLASH_PAGE_SIZE);
    return FLASH_COMPLETE;
}

FLASH_Status FLASH_ProgramHalfWord(uint32_t address, uint16_t data)
{
    uint16_t before;
    memcpy(&before, at(address), sizeof before);
    CHECK(unlocked && address % 2 == 0 && (before == 0xFFFF || data == 0));
    if (++operations == cut_at)
        data = (uint16_t)(before & (data | random_bits()));
    memcpy(at(address), &data, sizeof data);
    if (operations == cut_at)
        longjmp(lost, 1);
    return FLASH_COMPLETE;
}

uint32_t millis(void)
{
    return now;
}

bool feature(uint32_t mask)
{
    return mask == FEATURE_PASS && pass;
}

bool MissionEndUpload(void)
{
    const bool open = upload_open;
    upload_open = false;
    return open;
}

static void read_configuration(void)
{
    memcpy(&cfg, at(FLASH_WRITE_ADDR), sizeof cfg);
    MissionLoad();
}

static uint8_t check_of(const void *configuration)
{
    const uint8_t *bytes = configuration;
    uint8_t check = 0;
    for (unsigned i = 0; i < sizeof cfg; i++)
        check ^= bytes[i];
    return check;
}

static bool valid_configuration(void)
{
    const config_t *there = (const config_t *)(void *)at(FLASH_WRITE_ADDR);
    return there->version == VERSION && there->size == sizeof cfg && there->magic_be == 0xBE && there->magic_ef == 0xEF &&
           check_of(there) == 0;
}

static void complete(void)
{
    cfg.version = VERSION;
    cfg.size = sizeof cfg;
    cfg.magic_be = 0xBE;
    cfg.magic_ef = 0xEF;
    cfg.chk = 0;
    cfg.chk = check_of(&cfg);
}

static void program_place(void)
{
    uint16_t word;
    FLASH_Unlock();
    for (uint32_t page = 0; page < FLASH_PAGES_FORCONFIG; page++)
        FLASH_ErasePage(FLASH_WRITE_ADDR + page * FLASH_PAGE_SIZE);
    for (uint32_t i = 0; i < sizeof cfg; i += 2) {
        memcpy(&word, (const uint8_t *)&cfg + i, sizeof word);
        FLASH_ProgramHalfWord(FLASH_WRITE_ADDR + i, word);
    }
    FLASH_Lock();
}

void writeParams(uint8_t b)
{
    (void)b;
    config_writes++;
    MissionStore();
    complete();
    if (!ConfigIsWritten()) {
        ConfigStage();
        program_place();
        ConfigWritten();
    }
    read_configuration();
}

static void power_up(void)
{
    memset(&mission, 0, sizeof mission);
    memset(&f, 0, sizeof f);
    memset(&cfg, 0, sizeof cfg);
    ScheduleEEPROMwriteMS = 0;
    upload_open = pass = unlocked = false;
    rcData[THROTTLE] = 1000;
    ConfigStart(valid_configuration(), VERSION);
    if (!valid_configuration()) {
        memset(&cfg, 0, sizeof cfg); /* resetConf() */
        writeParams(0);
    }
    read_configuration();
}

/* Start a build without the extension, let it change its configuration, and switch it off. */
static void unpatched(uint8_t settings, uint16_t count, uint8_t fill)
{
    memcpy(&cfg, at(FLASH_WRITE_ADDR), sizeof cfg);
    memset(cfg.others, settings, sizeof cfg.others);
    cfg.FDUsedDatasets = count;
    if (count)
        memset(cfg.FloppyDisk, fill, sizeof cfg.FloppyDisk);
    complete();
    program_place();
}

/* A chip with only a configuration, with a list of `count` records from an unpatched firmware. */
static void new_chip(uint16_t count, uint8_t fill)
{
    memset(at(CONFIG_STAGED_ADDR), 0xFF, FLASH_END - CONFIG_STAGED_ADDR);
    memset(&cfg, 0, sizeof cfg);
    cfg.gps_wp_radius = 200;
    cfg.rc_minchk = 1100;
    memcpy(at(FLASH_WRITE_ADDR), &cfg, sizeof cfg);
    unpatched(OLD, count, fill);
    now = 1000;
    power_up();
}

/* A MAVLink upload that has put `count` records into RAM so far. */
static void upload(uint16_t count, uint8_t fill)
{
    upload_open = true;
    cfg.FDUsedDatasets = count;
    memset(cfg.FloppyDisk, fill, count * NM_RECORD_SIZE);
}

static void serve_scheduled_write(void)
{
    now += 1000;
    if (ScheduleEEPROMwriteMS && now >= ScheduleEEPROMwriteMS) {
        writeParams(0);
        ScheduleEEPROMwriteMS = 0;
    }
}

/* Push one record, all bytes 1 but for its command. Returns COMMIT's status. */
static int push_one(uint8_t command)
{
    uint8_t record[NM_RECORD_SIZE], chunk[NM_BUFFER_SIZE] = {0}, begin[NM_BUFFER_SIZE] = {0, 1, 0}, commit[NM_BUFFER_SIZE];
    memset(record, 1, sizeof record);
    record[NM_RECORD_SIZE - 1] = command;
    memcpy(chunk + 3, record, sizeof record);
    const uint32_t checksum = bitwise_crc32(record, sizeof record);
    memcpy(begin + 3, &checksum, 4);
    memcpy(commit, begin, 7);
    if (MissionRequest(NM_BEGIN, begin, 7) != 7 || begin[0] != NM_OK)
        return begin[0];
    CHECK(MissionRequest(NM_CHUNK, chunk, 19) == 7 && chunk[0] == NM_OK);
    CHECK(MissionRequest(NM_COMMIT, commit, 7) == 7 && !unlocked);
    return commit[0];
}

static int set_radius_to(uint16_t cm)
{
    uint8_t buffer[NM_BUFFER_SIZE] = {0, (uint8_t)cm, (uint8_t)(cm >> 8), (uint8_t)~cm, (uint8_t)((cm ^ 0xFFFF) >> 8)};
    CHECK(MissionRequest(NM_RADIUS, buffer, 5) == 3);
    return buffer[0];
}

static bool has(uint16_t count, uint8_t fill)
{
    return cfg.FDUsedDatasets == count && mission.stored.count == count && (count == 0 || cfg.FloppyDisk[0] == fill);
}

/* ---- tests ------------------------------------------------------------------------------------------------------------ */

static void test_a_list_from_before_the_patch_is_imported(void)
{
    new_chip(5, 9);
    CHECK(has(5, 9));
    power_up();
    CHECK(has(5, 9) && mission.sequence == 1);
}

static void test_an_invalid_configuration_has_no_list(void)
{
    new_chip(NM_CAPACITY + 1, 9);
    CHECK(has(0, 0));
}

static void test_an_interrupted_upload_keeps_the_stored_list(void)
{
    for (uint16_t stored = 0; stored <= 3; stored += 3) {
        new_chip(stored, 9);
        upload(2, 7);
        upload_open = false;
        MissionLoad(); /* the upload's timeout */
        CHECK(has(stored, 9));
        serve_scheduled_write();
        power_up();
        CHECK(has(stored, 9));
    }
}

static void test_a_write_of_the_configuration_ends_an_upload(void)
{
    new_chip(3, 9);
    upload(2, 7);
    writeParams(1); /* a calibration by stick */
    CHECK(!upload_open && has(3, 9));
}

static void test_a_complete_upload_is_stored_without_a_configuration_write(void)
{
    for (uint16_t count = 0; count <= 2; count += 2) {
        new_chip(3, 9);
        config_writes = 0;
        upload(count, 7);
        CHECK(MissionUploaded() && has(count, 7));
        CHECK(MissionUploaded()); /* its last item is repeated */
        upload_open = false;
        power_up();
        CHECK(has(count, 7) && config_writes == 0);
    }
}

static void test_arming_ends_an_upload(void)
{
    new_chip(3, 9);
    upload(2, 7);
    f.ARMED = 1;
    MissionPoll();
    CHECK(!upload_open && has(3, 9) && !MissionUploaded());
}

static void test_setters_need_their_exact_size(void)
{
    static const uint8_t setters[][2] = {{WP, 1}, {SET_RAW_RC, 16}, {SET_RAW_GPS, 14}, {SET_PID, 30}, {SET_BOX, 30},
                                         {SET_RC_TUNING, 7}, {ACC_CALIBRATION, 0}, {MAG_CALIBRATION, 0}, {RESET_CONF, 0},
                                         {EEPROM_WRITE, 0}};
    new_chip(0, 0);
    cfg.rc_auxch = 4;
    for (unsigned i = 0; i < sizeof setters / sizeof *setters; i++)
        for (unsigned size = 0; size < 256; size++)
            CHECK(GuardAccepts(setters[i][0], (uint8_t)size) == (size == setters[i][1]));
    cfg.rc_auxch = 6;
    CHECK(GuardAccepts(SET_BOX, 60) && !GuardAccepts(SET_BOX, 30));
    CHECK(!GuardAccepts(SET_MISC, 0) && GuardAccepts(SET_MISC, 22));
}

static void test_armed_only_reads_pass(void)
{
    new_chip(0, 0);
    for (unsigned with_pass = 0; with_pass < 2; with_pass++) {
        pass = with_pass;
        f.ARMED = !with_pass;
        rcData[THROTTLE] = 1500;
        for (unsigned command = 0; command < 256; command++)
            for (unsigned size = 0; size < 256; size++)
                CHECK(GuardAccepts((uint8_t)command, (uint8_t)size) ==
                      (command == WP ? size == 1 : command < 200 || command == DEBUG));
    }
    rcData[THROTTLE] = 1000;
    CHECK(GuardAccepts(EEPROM_WRITE, 0) && GuardAccepts(SET_PID, 3 * PIDITEMS));
}

static void test_the_slots_take_turns(void)
{
    new_chip(0, 0);
    for (uint8_t command = 0; command < 4; command++)
        CHECK(push_one(command) == NM_OK);
    power_up();
    CHECK(has(1, 1) && mission.sequence == 4);
}

static void test_the_configurations_copy_follows_with_the_next_write(void)
{
    const config_t *copy = (const config_t *)at(FLASH_WRITE_ADDR);
    new_chip(5, 9);
    config_writes = 0;
    CHECK(push_one(2) == NM_OK && has(1, 1) && copy->FDUsedDatasets == 5 && !config_writes);
    CHECK(set_radius_to(300) == NM_OK);
    serve_scheduled_write();
    CHECK(has(1, 1) && copy->FDUsedDatasets == 1 && copy->FloppyDisk[0] == 1 && copy->gps_wp_radius == 300);
}

static void test_writing_waits_for_a_scheduled_write(void)
{
    new_chip(0, 0);
    CHECK(set_radius_to(300) == NM_OK && push_one(0) == NM_BUSY);
    f.ARMED = 1;
    CHECK(push_one(0) == NM_ARMED);
    f.ARMED = 0;
    MissionPoll(); /* does nothing: without FEATURE_PASS Harakiri's main loop writes */
    CHECK(push_one(0) == NM_BUSY);
    serve_scheduled_write();
    CHECK(push_one(0) == NM_OK);
}

static void test_with_feature_pass_writes_wait_for_the_throttle(void)
{
    new_chip(0, 0);
    pass = true;
    config_writes = 0;
    CHECK(set_radius_to(300) == NM_OK);
    rcData[THROTTLE] = 1500;
    MissionPoll();
    CHECK(config_writes == 0 && push_one(0) == NM_ARMED);
    rcData[THROTTLE] = 1000;
    MissionPoll();
    CHECK(config_writes == 1 && ScheduleEEPROMwriteMS == 0 && push_one(0) == NM_OK);
    ScheduleEEPROMwriteMS = now + 500;
    MissionPoll();
    CHECK(config_writes == 1);
    now += 500;
    MissionPoll();
    MissionPoll();
    CHECK(config_writes == 2);
}

static bool settings_are(uint8_t byte)
{
    for (unsigned i = 0; i < sizeof cfg.others; i++)
        if (cfg.others[i] != byte)
            return false;
    return cfg.gps_wp_radius == 200 && cfg.rc_minchk == 1100 && valid_configuration();
}

static void save(uint8_t settings)
{
    memset(cfg.others, settings, sizeof cfg.others);
    writeParams(0);
}

/* Run `action` until the power is cut at a flash operation, then power up. False if the action needs fewer operations. */
static bool cut(void (*action)(void), unsigned operation)
{
    operations = 0;
    cut_at = operation;
    if (!setjmp(lost)) {
        action();
        cut_at = 0;
        return false;
    }
    cut_at = 0;
    return true;
}

static void save_new(void)
{
    save(NEW);
}

static void test_a_power_cut_at_every_operation_leaves_a_whole_configuration(void)
{
    static uint8_t before[FLASH_END - CONFIG_STAGED_ADDR], after_cut[sizeof before];
    volatile unsigned cuts = 0, restarts = 0, new = 0;
    new_chip(3, 9);
    memcpy(before, at(CONFIG_STAGED_ADDR), sizeof before);
    for (volatile unsigned operation = 1;; operation += cut_step) {
        memcpy(at(CONFIG_STAGED_ADDR), before, sizeof before);
        power_up();
        seed = operation * 2654435761u | 1u;
        if (!cut(save_new, operation))
            break;
        memcpy(after_cut, at(CONFIG_STAGED_ADDR), sizeof before);
        power_up();
        CHECK((settings_are(OLD) || settings_are(NEW)) && has(3, 9));
        const bool is_new = settings_are(NEW);
        cuts++;
        new += is_new;
        /* The power is cut again at some operations of the start that finishes the write. */
        for (volatile unsigned again = 1; again < 3000; again += 1 + random_bits() % 97) {
            memcpy(at(CONFIG_STAGED_ADDR), after_cut, sizeof before);
            if (!cut(power_up, again))
                break;
            power_up();
            CHECK(settings_are(is_new ? NEW : OLD) && has(3, 9));
            restarts++;
        }
        save(OLD + 1);
        power_up();
        CHECK(settings_are(OLD + 1) && has(3, 9));
    }
    CHECK(cuts > 1000 / cut_step && new > 0 && new < cuts && restarts > cuts);
    printf("  power cut at each flash operation of a configuration write, in steps of %u: %u of %u left the old or\n"
           "  the new one, and %u of %u at operations of the start after it\n", cut_step, cuts, cuts, restarts, restarts);
}

static void test_the_old_place_is_imported_once(void)
{
    new_chip(3, 9);
    CHECK(settings_are(OLD) && has(3, 9));
    operations = 0;
    power_up();
    CHECK(settings_are(OLD) && has(3, 9) && operations == 0);
}

static void test_an_unpatched_build_finds_the_last_configuration(void)
{
    const config_t *there = (const config_t *)(void *)at(FLASH_WRITE_ADDR);
    new_chip(3, 9);
    for (uint8_t settings = 1; settings < 5; settings++) {
        save(settings);
        CHECK(valid_configuration() && there->others[0] == settings && there->others[499] == settings);
    }
}

static void test_patching_again_takes_what_the_unpatched_build_has_changed(void)
{
    new_chip(3, 9);
    CHECK(push_one(2) == NM_OK);
    unpatched(NEW, 3, 9); /* it has the list of the last configuration write, and keeps it */
    power_up();
    CHECK(settings_are(NEW) && has(1, 1));
    save(OLD);
    unpatched(NEW, 5, 7);
    power_up();
    CHECK(settings_are(NEW) && has(5, 7));
    CHECK(push_one(3) == NM_OK);
    unpatched(OLD, 5, 7);
    power_up();
    CHECK(settings_are(OLD) && has(1, 1));
}

static void test_the_first_slot_saves_what_an_unpatched_build_loses(void)
{
    new_chip(3, 9);
    save(NEW);
    memset(at(FLASH_WRITE_ADDR), 0xFF, FLASH_PAGE_SIZE);
    power_up();
    CHECK(settings_are(NEW) && has(3, 9));
}

static void test_what_is_stored_is_not_written_again(void)
{
    new_chip(3, 9);
    save(NEW);
    operations = 0;
    save(NEW);
    CHECK(operations == 0);
}

static void test_the_budget_covers_requests_that_write_the_configuration(void)
{
    unsigned accepted = 0;
    new_chip(0, 0);
    CHECK(GuardAccepts(EEPROM_WRITE, 0) && mission.writes_left == 250);
    for (unsigned i = 0; i < 500; i++) {
        cfg.rc_minchk = (uint16_t)(2000 + i);
        accepted += GuardAccepts(EEPROM_WRITE, 0);
    }
    CHECK(accepted == 250 && !GuardAccepts(ACC_CALIBRATION, 0) && !GuardAccepts(RESET_CONF, 0));
    now += 300000;
    MissionPoll();
    CHECK(GuardAccepts(EEPROM_WRITE, 0) && !GuardAccepts(EEPROM_WRITE, 0));
}

/* Saves, pushes, power cuts and unpatched builds in any order: a configuration is the last one or the one being written. */
static void test_a_random_history_loses_nothing(void)
{
    volatile uint8_t settings = OLD;
    new_chip(0, 0);
    for (volatile unsigned step = 0; step < 3000 / cut_step; step++) {
        const uint8_t next = (uint8_t)step;
        seed = step * 2654435761u | 1u;
        switch (random_bits() % 4) {
        case 0:
            save(next);
            settings = next;
            break;
        case 1:
            CHECK(push_one((uint8_t)(step % 8)) <= NM_SAME);
            power_up();
            CHECK(has(1, 1));
            break;
        case 2:
            unpatched(next, cfg.FDUsedDatasets, cfg.FloppyDisk[0]);
            settings = next;
            power_up();
            break;
        default:
            memset(cfg.others, next, sizeof cfg.others);
            cut_at = operations = 0;
            cut_at = 1 + random_bits() % 1500;
            if (!setjmp(lost))
                writeParams(0);
            cut_at = 0;
            power_up();
            CHECK(settings_are(settings) || settings_are(next));
            settings = cfg.others[0];
        }
        CHECK(settings_are(settings));
    }
}

/* ---- settings --------------------------------------------------------------------------------------------------------- */

static uint8_t reply[NM_BUFFER_SIZE];

static int ask(uint8_t command, const void *body, uint8_t size)
{
    reply[0] = 0x5A; /* the mask */
    for (uint8_t i = 0; i < size; i++)
        reply[1 + i] = ((const uint8_t *)body)[i] ^ 0x5A;
    return MissionRequest(command, reply, (uint8_t)(size + 1));
}

static int read_from(uint16_t first, uint16_t count)
{
    const uint16_t body[2] = {first, count};
    return ask(SETTING, body, sizeof body);
}

static int set_to(uint16_t index, uint32_t identity, uint32_t value)
{
    uint8_t body[SET_SETTING_BODY];
    memcpy(body, &index, 2);
    memcpy(body + 2, &identity, 4);
    memcpy(body + 6, &value, 4);
    return ask(SET_SETTING, body, sizeof body);
}

static uint32_t identity_of(uint16_t index)
{
    const int size = read_from(index, 1);
    CHECK(size > HEADER_SIZE + NAME_AT && reply[0] == NM_OK);
    return bitwise_crc32(reply + HEADER_SIZE + TYPE_AT, (uint32_t)(size - HEADER_SIZE - TYPE_AT));
}

static int set(uint16_t index, uint32_t value)
{
    const uint32_t identity = identity_of(index);
    (void)set_to(index, identity, value);
    return reply[0];
}

static uint32_t table_checksum(void)
{
    uint32_t checksum;
    CHECK(read_from(WHOLE_TABLE, 1) == TABLE_SIZE && reply[0] == NM_OK && reply[3] == SETTINGS);
    memcpy(&checksum, reply + 5, 4);
    return checksum;
}

static void new_board(void)
{
    new_chip(0, 0);
    cfg.serial_baudrate = 115200;
    cfg.esc_moff = 1000;
    cfg.rc_auxch = 4;
    cfg.bar_lag = 0.3f;
    writeParams(0);
    config_writes = 0;
}

static void test_settings_take_their_range_and_nothing_else(void)
{
    for (uint16_t index = 0; index < SETTINGS; index++) {
        const setting_t *s = &settings_table[index];
        if (s->type == SETTING_FLOAT || s->variable == &cfg.esc_moff || is_fixed(s))
            continue;
        new_board();
        CHECK(set(index, (uint32_t)s->max) == NM_OK && held(s) == (uint32_t)s->max);
        CHECK(set(index, (uint32_t)s->min) == NM_OK && held(s) == (uint32_t)s->min);
        CHECK(set(index, (uint32_t)s->max + 1) == NM_RANGE && set(index, (uint32_t)s->min - 1) == NM_RANGE);
        CHECK(held(s) == (uint32_t)s->min && reply[0] == NM_RANGE && reply[HEADER_SIZE + TYPE_AT] == s->type);
    }
}

static void test_a_float_takes_numbers_in_range(void)
{
    static const uint32_t refused[] = {0x7FC00000u, 0x7F800000u, 0xFF800000u, 0xBF800000u, 0x41200001u};
    new_board();
    for (unsigned i = 0; i < sizeof refused / sizeof *refused; i++)
        CHECK(set(5, refused[i]) == NM_RANGE);
    CHECK(set(5, 0x41200000u) == NM_OK && held(&settings_table[5]) == 0x41200000u);
}

static void test_the_motors_off_pulse_is_not_raised(void)
{
    new_board();
    CHECK(set(6, 1001) == NM_RANGE && set(6, 900) == NM_OK && set(6, 901) == NM_RANGE && cfg.esc_moff == 900);
}

static void test_settings_that_crash_a_running_board_are_not_changed(void)
{
    new_board();
    CHECK(set(10, 0) == NM_OK && set(10, 255) == NM_RANGE && cfg.gbl_flg == 0);
    CHECK(set(9, 0) == NM_OK && set(9, 1) == NM_RANGE && set(9, (uint32_t)-3) == NM_RANGE && cfg.align[1][2] == 0);
}

static void test_another_sensor_clears_the_calibration(void)
{
    new_board();
    cfg.acc_calibrated = cfg.mag_calibrated = 1;
    cfg.angleTrim[1] = cfg.accZero[2] = 5;
    CHECK(set(7, 0) == NM_OK && cfg.acc_calibrated && set(7, 1) == NM_OK && !cfg.acc_calibrated && cfg.mag_calibrated);
    CHECK(!(cfg.angleTrim[1] > 0) && !(cfg.accZero[2] > 0) && cfg.sens_1G == 1);
    CHECK(set(8, 1) == NM_OK && !cfg.mag_calibrated);
}

static void test_only_the_described_setting_is_set(void)
{
    new_board();
    for (uint16_t index = 0; index < SETTINGS; index++) {
        const uint32_t identity = identity_of((uint16_t)((index + 1) % SETTINGS));
        CHECK(set_to(index, identity, 1) == HEADER_SIZE && reply[0] == NM_CHECKSUM);
    }
    CHECK(set_to(SETTINGS, 0, 1) == HEADER_SIZE && reply[0] == NM_RANGE);
    CHECK(read_from(SETTINGS, 1) == HEADER_SIZE && reply[0] == NM_RANGE);
}

static void test_requests_of_another_size_are_refused(void)
{
    static uint8_t body[NM_BUFFER_SIZE];
    new_board();
    for (uint8_t size = 0; size < NM_BUFFER_SIZE - 1; size++) {
        if (size != SETTING_BODY)
            CHECK(ask(SETTING, body, size) == HEADER_SIZE && reply[0] == NM_BAD_REQUEST);
        if (size != SET_SETTING_BODY)
            CHECK(ask(SET_SETTING, body, size) == HEADER_SIZE && reply[0] == NM_BAD_REQUEST);
    }
    CHECK(read_from(0, 0) == HEADER_SIZE && reply[0] == NM_BAD_REQUEST);
    CHECK(set_to(WHOLE_TABLE, 1, table_checksum()) == HEADER_SIZE && reply[0] == NM_BAD_REQUEST);
}

static void test_a_reply_holds_as_many_settings_as_fit(void)
{
    new_board();
    const int size = read_from(0, 0xFFFF);
    CHECK(size > HEADER_SIZE && size <= (int)REPLY_MAX_SIZE);
    CHECK(read_from(SETTINGS - 1, 9) == HEADER_SIZE + NAME_AT + NAME_MAX_SIZE);
}

static void test_a_save_writes_what_was_announced(void)
{
    new_board();
    CHECK(set(0, 7) == NM_OK);
    CHECK(set_to(WHOLE_TABLE, 0, 1) == TABLE_SIZE && reply[0] == NM_CHECKSUM && !ScheduleEEPROMwriteMS);
    const uint32_t wanted = table_checksum();
    CHECK(set_to(WHOLE_TABLE, 0, wanted) == TABLE_SIZE && reply[0] == NM_OK && ScheduleEEPROMwriteMS);
    const uint32_t identity = identity_of(0);
    CHECK(set_to(0, identity, 1) == HEADER_SIZE && reply[0] == NM_BUSY);
    CHECK(set_to(WHOLE_TABLE, 0, wanted) == HEADER_SIZE && reply[0] == NM_BUSY);
    serve_scheduled_write();
    power_up();
    CHECK(config_writes == 1 && cfg.rc_db == 7 && table_checksum() == wanted);
    CHECK(set(0, 8) == NM_OK);
    mission.writes_left = 0;
    CHECK(set_to(WHOLE_TABLE, 0, table_checksum()) == TABLE_SIZE && reply[0] == NM_BUSY && !ScheduleEEPROMwriteMS);
}

static void test_armed_no_setting_is_read_set_or_saved(void)
{
    new_board();
    const uint32_t wanted = table_checksum(), identity = identity_of(0);
    const config_t before = cfg;
    for (int with_pass = 0; with_pass < 2; with_pass++) {
        f.ARMED = !with_pass;
        pass = with_pass;
        rcData[THROTTLE] = 1500;
        CHECK(read_from(0, 1) == HEADER_SIZE && reply[0] == NM_ARMED);
        CHECK(read_from(WHOLE_TABLE, 1) == HEADER_SIZE && reply[0] == NM_ARMED);
        CHECK(set_to(0, identity, 1) == HEADER_SIZE && reply[0] == NM_ARMED);
        CHECK(set_to(WHOLE_TABLE, 0, wanted) == HEADER_SIZE && reply[0] == NM_ARMED);
    }
    CHECK(memcmp(&before, &cfg, sizeof cfg) == 0 && !ScheduleEEPROMwriteMS);
}

/* Arguments: cut_step. */
int main(int argc, char **argv)
{
    static void (*const tests[])(void) = {
        test_a_list_from_before_the_patch_is_imported,
        test_an_invalid_configuration_has_no_list,
        test_an_interrupted_upload_keeps_the_stored_list,
        test_a_write_of_the_configuration_ends_an_upload,
        test_a_complete_upload_is_stored_without_a_configuration_write,
        test_arming_ends_an_upload,
        test_setters_need_their_exact_size,
        test_armed_only_reads_pass,
        test_the_slots_take_turns,
        test_the_configurations_copy_follows_with_the_next_write,
        test_writing_waits_for_a_scheduled_write,
        test_with_feature_pass_writes_wait_for_the_throttle,
        test_a_power_cut_at_every_operation_leaves_a_whole_configuration,
        test_the_old_place_is_imported_once,
        test_an_unpatched_build_finds_the_last_configuration,
        test_patching_again_takes_what_the_unpatched_build_has_changed,
        test_the_first_slot_saves_what_an_unpatched_build_loses,
        test_what_is_stored_is_not_written_again,
        test_the_budget_covers_requests_that_write_the_configuration,
        test_a_random_history_loses_nothing,
        test_settings_take_their_range_and_nothing_else,
        test_a_float_takes_numbers_in_range,
        test_the_motors_off_pulse_is_not_raised,
        test_settings_that_crash_a_running_board_are_not_changed,
        test_another_sensor_clears_the_calibration,
        test_only_the_described_setting_is_set,
        test_requests_of_another_size_are_refused,
        test_a_reply_holds_as_many_settings_as_fit,
        test_a_save_writes_what_was_announced,
        test_armed_no_setting_is_read_set_or_saved,
    };
    void *const flash_at = (void *)(uintptr_t)FLASH_START;
    CHECK(mmap(flash_at, FLASH_END - FLASH_START, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE,
               -1, 0) == flash_at);
    if (argc > 1)
        cut_step = (unsigned)atoi(argv[1]);
    CHECK(cut_step >= 1);
    for (unsigned i = 0; i < sizeof tests / sizeof *tests; i++)
        tests[i]();
    printf("  %u tests of Harakiri's side passed\n", (unsigned)(sizeof tests / sizeof *tests));
    return 0;
}
