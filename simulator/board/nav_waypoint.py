# SPDX-License-Identifier: GPL-3.0-or-later
"""A waypoint as MSP_WP and MSP_SET_WP carry it (layout: protocols/msp/nav.py)."""

import struct
from dataclasses import dataclass

from protocols.msp.nav import NavAction

_LAYOUT = struct.Struct("<BBiiihhhB")
WAYPOINT_SIZE = _LAYOUT.size
FLAG_LAST, FLAG_HOME = 0xA5, 0x48


@dataclass(frozen=True, slots=True)
class NavWaypoint:
    """`action` may be any byte. Degrees * 1e7 and centimetres. The meaning of p1 to p3 depends on the action."""

    action: int = NavAction.RTH
    lat_e7: int = 0
    lon_e7: int = 0
    alt_cm: int = 0
    p1: int = 0
    p2: int = 0
    p3: int = 0
    flag: int = FLAG_LAST

    def pack(self, number: int) -> bytes:
        """The 21 payload bytes."""
        position = (self.lat_e7, self.lon_e7, self.alt_cm)
        return _LAYOUT.pack(number, self.action, *position, self.p1, self.p2, self.p3, self.flag)


def unpack_waypoint(payload: bytes) -> tuple[int, NavWaypoint]:
    """Number and waypoint. Raises struct.error unless there are 21 bytes."""
    number, *fields = _LAYOUT.unpack(payload)
    return number, NavWaypoint(*fields)


def wrap16(value: int) -> int:
    """Wrap a number to a signed 16-bit field."""
    return (value + 0x8000) % 0x10000 - 0x8000
