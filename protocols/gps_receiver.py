# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises a GPS receiver by its unsolicited NMEA sentences (NMEA 0183) or UBX frames (u-blox).

The data is not decoded.
"""

import re
from functools import reduce
from itertools import accumulate
from operator import xor

_NMEA = re.compile(rb"\$((?:G[A-Z]|BD|P)[A-Z]{3},[ -)+-~]{0,90})\*([0-9A-F]{2})")
_UBX_SYNC = b"\xb5\x62"
_UBX_FRAME = 8
_UBX_LONGEST = 1024
#: At least an NMEA sentence.
_LONGEST_SENTENCE = 110


class GpsWatch:
    """Feed bytes; `heard` names the protocol after a complete sentence or frame with a valid checksum."""

    def __init__(self) -> None:
        self.heard = ""
        self._text = self._frame = b""

    def feed(self, data: bytes) -> None:
        if self.heard:
            return
        text = self._text + data
        self._text = text[text.rfind(b"$") :][-_LONGEST_SENTENCE:]
        if any(reduce(xor, body) == int(checksum, 16) for body, checksum in _NMEA.findall(text)):
            self.heard = "NMEA"
        elif self._has_ubx(self._frame + data):
            self.heard = "UBX"

    def _has_ubx(self, data: bytes) -> bool:
        """Try each frame once, when it is complete."""
        start = data.find(_UBX_SYNC)
        while start >= 0:
            end = start + _UBX_FRAME + int.from_bytes(data[start + 4 : start + 6], "little")
            if end <= start + _UBX_FRAME + _UBX_LONGEST:
                if end > len(data):
                    break
                if _fletcher(data[start + 2 : end - 2]) == data[end - 2 : end]:
                    return True
            start = data.find(_UBX_SYNC, start + 1)
        # The next sync's first byte may be the last.
        self._frame = data[start:]
        return False


def _fletcher(data: bytes) -> bytes:
    return bytes((sum(data) & 0xFF, sum(accumulate(data)) & 0xFF))
