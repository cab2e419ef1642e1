# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's 16-byte mission record `wp_t` (firmware: mw.h, floppy.c; layout: docs/msp-mission.md)."""

import struct
from dataclasses import dataclass
from enum import IntEnum

RECORD_SIZE = 16
_LAYOUT = struct.Struct("<iihhBBbB")


class WpCommand(IntEnum):
    """The firmware's own command numbers (MavlnkCommand in floppy.c)."""

    WAYPOINT = 0
    LOITER_UNLIM = 1
    LOITER_TURNS = 2
    LOITER_TIME = 3
    RETURN_TO_LAUNCH = 4
    LAND = 5
    TAKEOFF = 6
    SETROI = 7


@dataclass(frozen=True, slots=True)
class WpRecord:
    """One record; its number is its position in the list, record 0 is the home point.

    lat_e7, lon_e7: degrees * 1e7. height_m: above the launch point. roi_heading: 1 = nose to the region of interest.
    time: LOITER_TIME seconds 1..255, WAYPOINT 1 = brake. radius_m: hit radius. turns: LOITER_TURNS, negative CCW.
    `command` is a plain int because a flight controller may have an unknown number.
    """

    lat_e7: int
    lon_e7: int
    height_m: int
    roi_heading: int
    time: int
    radius_m: int
    turns: int
    command: int

    def pack(self) -> bytes:
        """Return the 16 bytes; struct.error if a field does not fit, which is a bug in the caller."""
        return _LAYOUT.pack(
            self.lat_e7,
            self.lon_e7,
            self.height_m,
            self.roi_heading,
            self.time,
            self.radius_m,
            self.turns,
            self.command,
        )


def unpack_records(data: bytes) -> list[WpRecord]:
    """Read every complete record in `data`; a shorter rest is ignored."""
    whole = len(data) - len(data) % RECORD_SIZE
    return [WpRecord(*fields) for fields in _LAYOUT.iter_unpack(data[:whole])]
