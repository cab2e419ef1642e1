# SPDX-License-Identifier: GPL-3.0-or-later
"""Line effects on bytes: a UART at another speed, and noise."""

import random
from functools import lru_cache

_FRAME_BITS = 10
#: The levels of each byte's frame on the wire.
_FRAMES = tuple(bytes((0, *(byte >> shift & 1 for shift in range(8)), 1)) for byte in range(256))


# A search for the speed sends the same few frames again and again.
@lru_cache(maxsize=1024)
def garble(data: bytes, sent_baud: int, read_baud: int) -> bytes:
    """The bytes that a receiver at `read_baud` gets from `data` sent back to back at `sent_baud`.

    8N1 as on the STM32: wait for the falling edge, sample each bit in the middle, and deliver a byte even if its stop
    bit is low. So a wrong speed gives exactly the bytes that it would give on a wire, including harmful bytes. Speed 0
    is a disconnected port.
    """
    if sent_baud == read_baud:
        return data
    if not (sent_baud and read_baud):
        return b""
    sent_bits_per_read = sent_baud / read_baud
    first, *offsets = ((index + 0.5) * sent_bits_per_read for index in range(1, _FRAME_BITS))
    # The idle line is high.
    wire = b"".join([_FRAMES[byte] for byte in data]) + b"\1" * int(_FRAME_BITS * sent_bits_per_read + 1)
    received = bytearray()
    edge = wire.find(0)
    while edge >= 0:
        bits = wire[int(edge + first)]
        for shift, offset in enumerate(offsets, 1):
            bits |= wire[int(edge + offset)] << shift
        received.append(bits & 0xFF)
        after = int(edge + offsets[-1])
        if not bits >> 8:
            after = wire.find(1, after)
        edge = wire.find(0, after) if after >= 0 else -1
    return bytes(received)


def disturb(data: bytes, lost_byte_rate: float, bit_error_rate: float, dice: random.Random) -> bytes:
    """Drop bytes and flip bits. The rates are probabilities."""
    if not (data and (lost_byte_rate or bit_error_rate)):
        return data
    kept = (byte for byte in data if dice.random() >= lost_byte_rate) if lost_byte_rate else data
    if not bit_error_rate:
        return bytes(kept)
    return bytes(byte ^ sum((dice.random() < bit_error_rate) << bit for bit in range(8)) for byte in kept)
