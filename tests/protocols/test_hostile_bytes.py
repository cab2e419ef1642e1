# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes chosen to cost time: no parser executes more than a few lines of code for each."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import pytest

from protocols.mavlink.frame import MavlinkSplitter
from protocols.msp.command_line import EchoWatch
from protocols.msp.frame import MspParser

SIZE = 10_000
#: A block of the data flash, the largest reply of an INAV.
LARGEST_REPLY = 4112
#: Above a false header every 7 bytes whose checksum is computed line by line over 256 bytes.
LINES_PER_BYTE = 60
#: A header that claims a long frame, or the beginning of something else, repeated.
PATTERNS = {
    "MAVLink 1 magics": b"\xfe",
    "MAVLink 2 magics": b"\xfd",
    "MAVLink 1 heartbeats": b"\xfe\x09\x00\x01\x01\x00",
    "MAVLink 2 headers": b"\xfd\xff\x00\x00\x00\x01\x01\x01\x00\x00",
    "signed headers": b"\xfd\xff\x01\x00\x00\x01\x01\x01\x00\x00",
    "MSP": b"$",
    "MSP requests": b"$M<\xff\x01",
    "MSP jumbo replies": b"$M>\xff\x01" + LARGEST_REPLY.to_bytes(2, "little"),
    "MSP v2 requests": b"$X<\x00\x01\x01\xff\x00",
    "MSP v2 replies": b"$X>\x00\xff\xff" + LARGEST_REPLY.to_bytes(2, "little"),
    "MSP v2 errors": b"$X!\x00\xff\xff" + (LARGEST_REPLY // 2).to_bytes(2, "little"),
    "NMEA": b"$GPGGA,",
    "NMEA with wrong checksums": b"$GPGGA,*00",
    "UBX headers": b"\xb5\x62\x01\x01\xff\x00",
    "long UBX headers": b"\xb5\x62\x01\x01\x00\x04",
}


def in_pieces(feed: Callable[[bytes], Any]) -> Callable[[bytes, int], None]:
    def parse(data: bytes, size: int) -> None:
        for start in range(0, len(data), size):
            feed(data[start : start + size])

    return parse


def mavlink(data: bytes, size: int) -> None:
    splitter = MavlinkSplitter()
    in_pieces(splitter.feed)(data, size)
    splitter.feed(b"", is_end=True)


def msp(data: bytes, size: int) -> None:
    parser = MspParser(takes_low_v2=size != SIZE)
    in_pieces(parser.feed)(data, size)
    parser.reset()


PARSERS: dict[str, Callable[[bytes, int], None]] = {
    "MAVLink": mavlink,
    "MSP": msp,
    "echo": lambda data, size: in_pieces(EchoWatch().feed)(data, size),
}


@contextmanager
def counted_lines() -> Iterator[list[int]]:
    """Count the lines executed in protocols/."""
    count = [0]

    def line(_frame: FrameType, event: str, _argument: object) -> object:
        count[0] += event == "line"
        return line

    def call(frame: FrameType, _event: str, _argument: object) -> object:
        return line if "/protocols/" in frame.f_code.co_filename else None

    before = sys.gettrace()
    sys.settrace(call)  # type: ignore[arg-type]
    try:
        yield count
    finally:
        sys.settrace(before)


@pytest.mark.parametrize("size", [1, SIZE])
@pytest.mark.parametrize("name", PARSERS)
def test_a_damaged_byte_costs_at_most_a_few_lines(name: str, size: int) -> None:
    for title, pattern in PATTERNS.items():
        data = (pattern * (SIZE // len(pattern) + 1))[:SIZE]
        with counted_lines() as lines:
            PARSERS[name](data, size)
        assert lines[0] <= LINES_PER_BYTE * SIZE, (title, lines[0] / SIZE)
