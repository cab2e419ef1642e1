# SPDX-License-Identifier: GPL-3.0-or-later
"""Line effects on bytes: a UART at another speed, and noise."""

import random
from functools import lru_cache

_FRAME_BITS = 10


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
    wire = bytes(bit for byte in data for bit in (0, *(byte >> shift & 1 for shift in range(8)), 1))
    sent_bits_per_read = sent_baud / read_baud
    received = bytearray()
    edge = wire.find(0)
    while edge >= 0:
        # The idle line is high.
        samples = (int(edge + (index + 0.5) * sent_bits_per_read) for index in range(_FRAME_BITS))
        _, *bits, stop = (wire[at] if at < len(wire) else 1 for at in samples)
        received.append(sum(bit << shift for shift, bit in enumerate(bits)))
        after = int(edge + (_FRAME_BITS - 0.5) * sent_bits_per_read)
        if not stop:
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
