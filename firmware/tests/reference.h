/* SPDX-License-Identifier: GPL-3.0-or-later */
/* CRC-32 by its definition, against which the tests compare the core's. */
#ifndef REFERENCE_H
#define REFERENCE_H

#include <stdint.h>

static inline uint32_t bitwise_crc32(const uint8_t *data, uint32_t length)
{
    uint32_t crc = 0xFFFFFFFFu;
    while (length--) {
        crc ^= *data++;
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
    }
    return ~crc;
}

#endif
