# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission item as sent in a message or a file. The records that flight controllers store, and a list's checksum."""

import math
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Protocol


class Command(IntEnum):
    """MAV_CMD numbers that MultiWii-family flight controllers support."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_ROI = 80
    CONDITION_YAW = 115
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI_NONE = 197
    DO_SET_ROI = 201
    FENCE_RETURN_POINT = 5000
    FENCE_POLYGON_INCLUSION = 5001
    FENCE_POLYGON_EXCLUSION = 5002
    FENCE_CIRCLE_INCLUSION = 5003
    FENCE_CIRCLE_EXCLUSION = 5004
    RALLY_POINT = 5100


#: Commands that set a region of interest.
ROI_COMMANDS = (Command.NAV_ROI, Command.DO_SET_ROI_LOCATION, Command.DO_SET_ROI)


class Frame(IntEnum):
    """MAV_FRAME numbers used by the rules."""

    GLOBAL = 0
    MISSION = 2
    GLOBAL_RELATIVE_ALT = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    GLOBAL_TERRAIN_ALT = 10
    GLOBAL_TERRAIN_ALT_INT = 11


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT, the result in a MISSION_ACK. ERROR is never a final reply (docs/ground-stations.md)."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


MAX_LAT_E7 = 90 * 10**7
MAX_LON_E7 = 180 * 10**7


@dataclass(frozen=True, slots=True)
class MissionItem:
    """An item of a mission list, as sent (any value is possible) or as stored.

    `lat_e7` and `lon_e7` are degrees * 1e7; 0 and None (not a finite number) both mean "missing".
    `alt_m` is in metres above the datum of `frame`. A parameter that was not given is NaN.
    """

    seq: int
    command: int
    frame: int
    p1: float
    p2: float
    p3: float
    p4: float
    lat_e7: int | None
    lon_e7: int | None
    alt_m: float


def is_on_earth(lat_e7: int, lon_e7: int) -> bool:
    return abs(lat_e7) <= MAX_LAT_E7 and abs(lon_e7) <= MAX_LON_E7


def degrees_to_e7(degrees: float) -> int | None:
    """Round degrees to 1e-7 degrees. Returns None if not a finite number (docs/mission-rules.md, "Each item")."""
    scaled = degrees * 1e7  # may overflow to infinity on its own
    return round(scaled) if math.isfinite(scaled) else None


def behind_home(items: Iterable[MissionItem], home: MissionItem) -> list[MissionItem]:
    """A list without home as one with it: every number is one higher, also the target of a jump."""
    moved = [replace(item, seq=item.seq + 1, p1=item.p1 + (item.command == Command.DO_JUMP)) for item in items]
    return [replace(home, seq=0), *moved]


class MissionRecord(Protocol):
    """One record as a flight controller stores it. The number is the position in the list."""

    def pack(self) -> bytes:
        """The bytes. Raises struct.error if a field does not fit, which is a bug in the caller."""


@dataclass(frozen=True, slots=True)
class ListIdentity:
    """The identity of a stored list: number of records and CRC-32 over their bytes (0 for none)."""

    count: int
    checksum: int

    def __str__(self) -> str:
        return f"{self.count} records, checksum {self.checksum:08x}"


def pack_records(records: Iterable[MissionRecord]) -> bytes:
    return b"".join([record.pack() for record in records])


def identify(records: Sequence[MissionRecord]) -> ListIdentity:
    """The identity of a list. A Harakiri with the mission extension computes the same."""
    return ListIdentity(len(records), zlib.crc32(pack_records(records)))
