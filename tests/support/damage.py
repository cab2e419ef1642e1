# SPDX-License-Identifier: GPL-3.0-or-later
"""Streams of MAVLink frames with one kind of damage."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from random import Random

MAGIC_V2 = 0xFD
_NOISE_SIZE = 40
_CRC_SIZE = 2
_SIGNATURE_SIZE = 13


class Damage(Enum):
    """The kind of damage to a frame, or before it."""

    NOISE = "noise"
    FAKE_HEADER = "fake header"
    CUT = "cut frame"
    BIT_FLIP = "bit flip"
    DROPPED_BYTE = "dropped byte"


@dataclass(frozen=True, slots=True)
class DamagedStream:
    """`pieces`: the bytes on the line, one piece per frame with its damage; `intact`: the undamaged frames."""

    pieces: list[bytes]
    intact: list[bytes]


def damaged_stream(frames: Sequence[bytes], damage: Damage, share: float, chance: Random) -> DamagedStream:
    """Apply `damage` to a share (0..1) of the frames."""
    pieces, intact = [], []
    for frame in frames:
        if chance.random() >= share:
            pieces.append(frame)
            intact.append(frame)
            continue
        piece = _damaged(frame, damage, chance)
        pieces.append(piece)
        if frame in piece:
            intact.append(frame)
    return DamagedStream(pieces, intact)


def _damaged(frame: bytes, damage: Damage, chance: Random) -> bytes:
    match damage:
        case Damage.NOISE:
            return chance.randbytes(chance.randint(1, _NOISE_SIZE)) + frame
        case Damage.FAKE_HEADER:
            header = bytearray(frame[: _header_size(frame)])
            header[1] = chance.randint(1, 255)
            return bytes(header) + frame
        case Damage.CUT:
            return frame[: chance.randint(1, len(frame) - 1)]
        case Damage.BIT_FLIP:
            at = chance.randrange(_checked_size(frame))
            return frame[:at] + bytes((frame[at] ^ 1 << chance.randrange(8),)) + frame[at + 1 :]
        case Damage.DROPPED_BYTE:
            at = chance.randrange(len(frame))
            return frame[:at] + frame[at + 1 :]


def _header_size(frame: bytes) -> int:
    return 10 if frame[0] == MAGIC_V2 else 6


def _checked_size(frame: bytes) -> int:
    """The frame's size without a signature: only the key's owner can notice a flipped bit in that."""
    return _header_size(frame) + frame[1] + _CRC_SIZE
