/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Harakiri's settings over MSP: the commands SETTING and SET_SETTING of docs/msp-mission.md.
 *
 * The settings are those of the CLI's `set`, taken from its own valueTable. A change is made in RAM; a save writes the
 * configuration with Harakiri's writeParams(). Nothing is read, set or saved while the motors may run.
 *
 * Call SettingsRequest() from the main loop only. No heap, no state of its own; under 120 bytes of stack. Reading the checksum
 * of all settings takes 3 ms.
 */
#ifndef HARAKIRI_SETTINGS_H
#define HARAKIRI_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

/* vartype_e (cli.c), and `type` of a setting on the wire. */
typedef enum {
    SETTING_UINT8 = 0,
    SETTING_INT8 = 1,
    SETTING_UINT16 = 2,
    SETTING_INT16 = 3,
    SETTING_UINT32 = 4,
    SETTING_FLOAT = 5
} setting_type_t;

/* An entry of the CLI's valueTable. `variable` points into cfg. */
typedef struct {
    const char *name;
    void *variable;
    int32_t min;
    int32_t max;
    uint8_t type;
} setting_t;

/* The patch adds this to cli.c: describe the setting with this index, from 0. False if there is none. */
bool SettingEntry(uint16_t index, setting_t *setting);

/*
 * Answer one request. `buffer` holds its payload of `size` bytes and takes the reply's payload; it has room for
 * NM_BUFFER_SIZE bytes. Returns the reply's length, or -1 if the command is neither of the two (buffer untouched).
 */
int SettingsRequest(uint8_t command, uint8_t *buffer, uint8_t size);

#endif
