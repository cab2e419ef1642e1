# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP v1 frames: `$M` direction size command payload xor (MultiWii; Harakiri's serial.c)."""

from dataclasses import dataclass
from enum import Enum
from functools import reduce
from operator import xor

_PREAMBLE = b"$M"
_HEADER_SIZE = 5
FRAME_OVERHEAD = _HEADER_SIZE + 1


class Direction(Enum):
    """The third byte of a frame."""

    REQUEST = ord("<")
    REPLY = ord(">")
    ERROR = ord("!")


_DIRECTIONS = {direction.value: direction for direction in Direction}


@dataclass(frozen=True, slots=True)
class MspFrame:
    """One frame. `command` 0..255, `payload` at most 255 bytes."""

    direction: Direction
    command: int
    payload: bytes = b""

    def encode(self) -> bytes:
        """Return the frame's bytes, checksum included."""
        body = bytes((len(self.payload), self.command)) + self.payload
        return b"$M" + bytes((self.direction.value,)) + body + bytes((reduce(xor, body),))


def request(command: int, payload: bytes = b"") -> bytes:
    """Encode a request to the flight controller."""
    return MspFrame(Direction.REQUEST, command, payload).encode()


class MspParser:
    """Finds frames in a byte stream. Never raises: what is not a frame is counted and skipped.

    After a bad checksum the search goes on one byte later, so a frame hidden behind a false header is still found.
    A frame that stays incomplete keeps its bytes until more come: call `reset` when the line has been silent.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.bad_checksums = 0
        self.skipped_bytes = 0

    def feed(self, data: bytes) -> list[MspFrame]:
        """Take bytes as they come and return the frames that they complete."""
        buffer = self._buffer
        buffer += data
        frames: list[MspFrame] = []
        start = 0
        while True:
            found = buffer.find(_PREAMBLE, start)
            if found < 0:
                # Keep a last '$': its 'M' may be the next byte to come.
                keep = 1 if buffer.endswith(b"$") else 0
                self.skipped_bytes += max(len(buffer) - keep - start, 0)
                start = max(len(buffer) - keep, start)
                break
            self.skipped_bytes += found - start
            start = found
            if len(buffer) - start < _HEADER_SIZE:
                if len(buffer) - start >= 3 and buffer[start + 2] not in _DIRECTIONS:
                    self.skipped_bytes += 1
                    start += 1
                    continue
                break
            direction = _DIRECTIONS.get(buffer[start + 2])
            if direction is None:
                self.skipped_bytes += 1
                start += 1
                continue
            end = start + FRAME_OVERHEAD + buffer[start + 3]
            if len(buffer) < end:
                break
            if reduce(xor, buffer[start + 3 : end]):
                self.bad_checksums += 1
                self.skipped_bytes += 1
                start += 1
                continue
            payload = bytes(buffer[start + _HEADER_SIZE : end - 1])
            frames.append(MspFrame(direction, buffer[start + 4], payload))
            start = end
        del buffer[:start]
        return frames

    def reset(self) -> list[MspFrame]:
        """Give up on an incomplete frame and return the frames that its bytes were hiding."""
        frames: list[MspFrame] = []
        while self._buffer:
            self.skipped_bytes += 1
            rest = bytes(self._buffer[1:])
            self._buffer.clear()
            frames += self.feed(rest)
        return frames
