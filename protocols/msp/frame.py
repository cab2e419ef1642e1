# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP frames in both versions.

v1, spoken by all: `$M` direction size command payload xor (MultiWii; Harakiri's serial.c). A reply of 255 bytes or
more has the size 255, and the size in 16 bits after the command ("jumbo", INAV's msp_serial.c). v2, for INAV's commands
above 255: `$X` direction flag command size payload crc, command and size 16 bits little-endian, DVB-S2's CRC of 8 bits.

Harakiri acts on three equal bytes in a row anywhere in the stream, inside frames and across their boundaries (serial.c,
serialCom): 0x0D enters the command line; in AUTOSENSE '#' does so too, and 'R' resets the board. So no frame to it has
one of these bytes (docs/msp-mission.md, "Masked bodies").
"""

import struct
from dataclasses import dataclass, field
from enum import Enum
from functools import partial, reduce
from itertools import filterfalse
from operator import xor

from fastcrc.crc8 import dvb_s2

HAZARDS = frozenset((0x0D, 0x23, 0x52))
RUN_LENGTH = 3

_START = b"$"
_V1, _V2 = ord("M"), ord("X")
_V2_HEADER = struct.Struct("<BHH")
_V1_OVERHEAD, _JUMBO_OVERHEAD, _V2_OVERHEAD = 6, 8, 9
#: Bytes of a v1 frame without the payload.
FRAME_OVERHEAD = _V1_OVERHEAD
_HIGHEST_V1_COMMAND = 0xFF
#: The size of a jumbo frame's payload, where v1 has one byte for it.
_JUMBO = 0xFF
_MAX_REQUEST = 255
#: INAV's largest reply, a block of the data flash. A header with a larger size is noise.
MAX_REPLY = 4096 + 16


class Direction(Enum):
    """The third byte of a frame."""

    REQUEST = ord("<")
    REPLY = ord(">")
    ERROR = ord("!")


_DIRECTIONS = {direction.value: direction for direction in Direction}
_REQUEST = Direction.REQUEST.value
_HEADS = tuple(bytes((*_START, version, direction)) for version in (_V1, _V2) for direction in _DIRECTIONS)
_HEAD_SIZE = 3


@dataclass(slots=True)  # not frozen, as in protocols.mavlink.frame
class MspFrame:
    """One frame. `payload`: at most 255 bytes in a request, else MAX_REPLY. A `command` above 255 makes it v2."""

    direction: Direction
    command: int
    payload: bytes = b""
    is_v2: bool = field(default=False, compare=False)

    def encode(self) -> bytes:
        direction = bytes((self.direction.value,))
        if self.is_v2 or self.command > _HIGHEST_V1_COMMAND:
            body = _V2_HEADER.pack(0, self.command, len(self.payload)) + self.payload
            return b"$X" + direction + body + bytes((dvb_s2(body),))
        size = len(self.payload)
        if size >= _JUMBO and self.direction is not Direction.REQUEST:
            body = bytes((_JUMBO, self.command)) + size.to_bytes(2, "little") + self.payload
        else:
            body = bytes((size, self.command)) + self.payload
        return b"$M" + direction + body + bytes((reduce(xor, body),))


def request(command: int, payload: bytes = b"") -> bytes:
    return MspFrame(Direction.REQUEST, command, payload).encode()


def frame_size(command: int, payload_size: int) -> int:
    return payload_size + (_V2_OVERHEAD if command > _HIGHEST_V1_COMMAND else _V1_OVERHEAD)


def is_clean(frame: bytes) -> bool:
    """True if `frame` is free of hazard bytes, so that no run can form, not even across frames or after a loss."""
    return HAZARDS.isdisjoint(frame)


def find_mask(body: bytes, fixed_xor: int) -> int | None:
    """Find the smallest mask that keeps mask, masked body and checksum free of hazards.

    `body` has an even length; `fixed_xor` is the XOR of the frame's other checksummed bytes (size and command).
    None if there is no such mask, which cannot happen for bodies of up to 83 bytes.
    """
    unfit = {*HAZARDS}
    checksum_without_mask = reduce(xor, body, fixed_xor)
    for hazard in HAZARDS:
        unfit.update(map(partial(xor, hazard), (*body, checksum_without_mask)))
    return next(filterfalse(unfit.__contains__, range(256)), None)


def apply_mask(body: bytes, mask: int) -> bytes:
    """XOR every byte of `body` with `mask`; the same call removes the mask."""
    return (int.from_bytes(body) ^ int.from_bytes(bytes((mask,)) * len(body))).to_bytes(len(body))


def clean_masked_request(command: int, body: bytes) -> bytes | None:
    """Encode a request with a masked body, or None if its frame would hold a hazard byte with every mask."""
    size = len(body) + 1
    mask = find_mask(body, size ^ command)
    if mask is None:
        return None
    frame = request(command, bytes((mask,)) + apply_mask(body, mask))
    return frame if is_clean(frame) else None


def masked_request(command: int, body: bytes) -> bytes:
    """Encode a request with a masked body of up to 83 bytes."""
    frame = clean_masked_request(command, body)
    if frame is None:
        raise AssertionError(f"a {len(body)} byte body always has a mask")
    return frame


class MspParser:
    """Finds frames in a byte stream. Never raises: bytes outside frames are counted and skipped.

    >>> MspParser().feed(request(105))
    [MspFrame(direction=<Direction.REQUEST: 60>, command=105, payload=b'', is_v2=False)]

    After a bad checksum the search resumes one byte later, so a frame hidden behind a false header is still found.
    `takes_low_v2`: accept v2 frames of v1's commands, too, as configurators send them; a flight controller sends such
    frames only in reply to them. Call `reset` when the line has been silent: bytes of an incomplete frame are kept.
    """

    def __init__(self, *, takes_low_v2: bool = False) -> None:
        self._takes_low_v2 = takes_low_v2
        self._buffer = bytearray()
        self.bad_checksums = 0
        self.skipped_bytes = 0

    def feed(self, data: bytes) -> list[MspFrame]:
        buffer = self._buffer
        buffer += data
        frames: list[MspFrame] = []
        framed = start = 0
        while (found := buffer.find(_START, start)) >= 0:
            start = found
            end = _frame_end(buffer, start, takes_low_v2=self._takes_low_v2)
            if end is None or len(buffer) < end:
                break
            frame = _decode(buffer[start:end]) if end > start else None
            if frame is None:
                self.bad_checksums += end > start
                start += 1
            else:
                frames.append(frame)
                framed += end - start
                start = end
        else:
            start = len(buffer)
        self.skipped_bytes += start - framed
        del buffer[:start]
        return frames

    @property
    def incomplete_bytes(self) -> int:
        """The size of the part of a frame that has arrived."""
        return len(self._buffer)

    def reset(self) -> list[MspFrame]:
        """Drop an incomplete frame. Return the frames found in its bytes."""
        frames: list[MspFrame] = []
        while self._buffer:
            self.skipped_bytes += 1
            rest = bytes(self._buffer[1:])
            self._buffer.clear()
            frames += self.feed(rest)
        return frames


def _frame_end(buffer: bytearray, start: int, *, takes_low_v2: bool) -> int | None:
    """The end of the frame at `start`, or None if its header is incomplete, `start` if it is not a frame."""
    size = len(buffer) - start
    if not buffer.startswith(_HEADS, start):
        cut = bytes(buffer[start : start + _HEAD_SIZE])
        return None if any(head.startswith(cut) for head in _HEADS) else start
    if size < _V1_OVERHEAD - 1:
        return None
    is_request = buffer[start + 2] == _REQUEST
    if buffer[start + 1] == _V1:
        if buffer[start + 3] < _JUMBO or is_request:
            return start + _V1_OVERHEAD + buffer[start + 3]
        if size < _JUMBO_OVERHEAD - 1:
            return None
        payload_size = int.from_bytes(buffer[start + 5 : start + 7], "little")
        return start + _JUMBO_OVERHEAD + payload_size if _JUMBO <= payload_size <= MAX_REPLY else start
    if size < _V2_OVERHEAD - 1:
        return None
    flag, command, payload_size = _V2_HEADER.unpack_from(buffer, start + 3)
    largest = _MAX_REQUEST if is_request else MAX_REPLY
    if flag or (command <= _HIGHEST_V1_COMMAND and not takes_low_v2) or payload_size > largest:
        return start
    return start + _V2_OVERHEAD + int(payload_size)


def _decode(frame: bytearray) -> MspFrame | None:
    """Decode a complete frame. Returns None if the checksum is wrong."""
    direction = _DIRECTIONS[frame[2]]
    if frame[1] == _V1:
        payload_at = 7 if frame[3] == _JUMBO and direction is not Direction.REQUEST else 5
        return None if _xor(frame[3:]) else MspFrame(direction, frame[4], bytes(frame[payload_at:-1]))
    body = bytes(frame[3:-1])
    if dvb_s2(body) != frame[-1]:
        return None
    return MspFrame(direction, int.from_bytes(body[1:3], "little"), body[_V2_HEADER.size :], is_v2=True)


def _xor(data: bytes | bytearray) -> int:
    """The checksum of v1. Halves at a time, because a damaged header may claim 4 KB."""
    value, size = int.from_bytes(data), len(data)
    while size > 1:
        size = (size + 1) // 2
        value = value >> 8 * size ^ value & (1 << 8 * size) - 1
    return value
