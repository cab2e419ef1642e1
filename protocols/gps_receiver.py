# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises a GPS receiver by its unsolicited NMEA sentences (NMEA 0183) or UBX frames (u-blox).

The data is not decoded.
"""

import re
from functools import reduce
from operator import xor

_NMEA = re.compile(rb"\$((?:G[A-Z]|BD|P)[A-Z]{3},[ -)+-~]{0,90})\*([0-9A-F]{2})")
_UBX_SYNC = b"\xb5\x62"
_UBX_FRAME = 8
_UBX_LONGEST = 1024
#: Longer than any NMEA sentence and usual UBX frame.
_KEPT = 1200


class GpsWatch:
    """Feed bytes; `heard` names the protocol after a complete sentence or frame with a valid checksum."""

    def __init__(self) -> None:
        self.heard = ""
        self._data = b""

    def feed(self, data: bytes) -> None:
        if self.heard:
            return
        self._data = (self._data + data)[-_KEPT:]
        if any(reduce(xor, body) == int(checksum, 16) for body, checksum in _NMEA.findall(self._data)):
            self.heard = "NMEA"
        elif _has_ubx(self._data):
            self.heard = "UBX"


def _has_ubx(data: bytes) -> bool:
    start = data.find(_UBX_SYNC)
    while start >= 0:
        size = int.from_bytes(data[start + 4 : start + 6], "little")
        frame = data[start : start + _UBX_FRAME + size]
        if size <= _UBX_LONGEST and len(frame) == _UBX_FRAME + size and _fletcher(frame[2:-2]) == frame[-2:]:
            return True
        start = data.find(_UBX_SYNC, start + 1)
    return False


def _fletcher(data: bytes) -> bytes:
    first = second = 0
    for byte in data:
        first = (first + byte) & 0xFF
        second = (second + first) & 0xFF
    return bytes((first, second))
