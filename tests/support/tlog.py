# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the records of an intact telemetry log; the last one may be cut off."""

from collections.abc import Iterator
from typing import NamedTuple

from protocols.mavlink.frame import MAGIC_V1, MavlinkFrame


class TlogRecord(NamedTuple):
    """A frame and its time, microseconds since the Unix epoch."""

    at_us: int
    frame: MavlinkFrame


def read_tlog(data: bytes) -> Iterator[TlogRecord]:
    at = 0
    while at + 10 < len(data):
        start = at + 8
        end = start + data[start + 1] + (8 if data[start] == MAGIC_V1 else 12)
        if end <= len(data):
            yield TlogRecord(int.from_bytes(data[at:start], "big"), MavlinkFrame(data[start:end]))
        at = end
