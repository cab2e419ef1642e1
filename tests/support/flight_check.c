/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A list before the flight core, as at the switch GPS AUTO: the reason of its refusal, 0 if it is flown. */
#include "naze_flight.h"

static bool read_list(void *self, uint16_t number, uint8_t *record)
{
    const uint8_t *from = (const uint8_t *)self + (uint32_t)number * NM_RECORD_SIZE;
    for (unsigned i = 0; i < NM_RECORD_SIZE; i++)
        record[i] = from[i];
    return true;
}

int check_list(uint8_t *records, uint16_t count, int32_t lat, int32_t lon, uint16_t first_m, uint16_t height_m,
               uint16_t fence_m)
{
    const bool takes_off = count > 1 && records[NM_RECORD_SIZE + 15] == 6;
    const nf_settings_t settings = {true, 200, first_m, height_m, fence_m, 100, 100, 100, 300};
    nf_input_t in = {0};
    nf_output_t out;
    nf_t f;
    in.place.lat = in.home.lat = lat;
    in.place.lon = in.home.lon = lon;
    in.list.count = count;
    in.list.checksum = nm_crc32(0, records, (uint32_t)count * NM_RECORD_SIZE);
    in.fix = in.home_known = in.instruments = true;
    in.flying = !takes_off;
    in.height_cm = takes_off ? 0 : 500;
    nf_start(&f, read_list, records);
    for (int step = 0; step < 40; step++) {
        in.now_ms += 20;
        in.armed = step > 0;
        in.switch_on = step > 1;
        nf_step(&f, &settings, &in, &out);
    }
    return f.state == NF_HELD || f.state == NF_OFF ? (int)f.reason : 0;
}
