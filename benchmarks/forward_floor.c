/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The lowest cost of passing MAVLink on: read, split, check the CRC, one sendto a frame.
 *
 * forward_floor TTY PORT: frames of MAVLink 2 go from a terminal in raw mode to a UDP port of the loopback. Only the
 * two messages of the benchmark are known.
 */
#define _POSIX_C_SOURCE 200809L
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { MAGIC = 0xFD, HEADER = 10, CRC = 2, SIGNATURE = 13, SIGNED = 1, HEARTBEAT = 0, RAW_IMU = 27 };

static uint16_t crc_of(const uint8_t *data, size_t size, uint8_t extra)
{
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i <= size; i++) {
        uint8_t byte = (i < size ? data[i] : extra) ^ (uint8_t)crc;
        byte ^= (uint8_t)(byte << 4);
        crc = (uint16_t)((crc >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4));
    }
    return crc;
}

static int crc_extra(const uint8_t *frame)
{
    switch (frame[7] | frame[8] << 8 | frame[9] << 16) {
    case HEARTBEAT: return 50;
    case RAW_IMU: return 144;
    default: return -1;
    }
}

/* Returns the size of the frame at `data`, 0 if more bytes are needed, -1 if there is none. */
static int frame_size(const uint8_t *data, size_t size)
{
    if (data[0] != MAGIC) return -1;
    if (size < HEADER) return 0;
    int extra = crc_extra(data);
    if (data[2] & ~SIGNED || extra < 0) return -1;
    size_t crc_at = HEADER + (size_t)data[1], end = crc_at + CRC + (data[2] & SIGNED ? SIGNATURE : 0);
    if (size < end) return 0;
    return crc_of(data + 1, crc_at - 1, (uint8_t)extra) == (data[crc_at] | data[crc_at + 1] << 8) ? (int)end : -1;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: %s TTY PORT\n", argv[0]);
        return 2;
    }
    int tty = open(argv[1], O_RDONLY | O_NOCTTY);
    int out = socket(AF_INET, SOCK_DGRAM, 0);
    if (tty < 0 || out < 0) {
        perror(argv[1]);
        return 1;
    }
    struct sockaddr_in ground;
    memset(&ground, 0, sizeof ground);
    ground.sin_family = AF_INET;
    ground.sin_port = htons((uint16_t)atoi(argv[2]));
    ground.sin_addr.s_addr = htonl(INADDR_LOOPBACK);

    static uint8_t buffer[8192];
    size_t held = 0;
    for (;;) {
        ssize_t came = read(tty, buffer + held, sizeof buffer - held);
        if (came <= 0) return 0;
        held += (size_t)came;
        size_t at = 0;
        while (at < held) {
            int size = frame_size(buffer + at, held - at);
            if (size == 0) break;
            if (size < 0) {
                at++;
                continue;
            }
            sendto(out, buffer + at, (size_t)size, 0, (struct sockaddr *)&ground, sizeof ground);
            at += (size_t)size;
        }
        held -= at;
        memmove(buffer, buffer + at, held);
    }
}
