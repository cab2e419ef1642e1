# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions over MSP_SET_WP: the records and requests of INAV and MultiWii NAV (docs/inav.md).

Records are numbered from 1. Numbers 0 and 255 are not part of a mission: writing them moves home, or a craft that
holds the position, so no frame with them can be encoded here.
"""

import struct
from dataclasses import dataclass, replace
from enum import IntEnum

from protocols.msp.frame import request

_WP = struct.Struct("<BBiiihhhB")
_BODY = struct.Struct("<BiiihhhB")
_INFO = struct.Struct("<BBBB")
_STATUS = struct.Struct("<BBBBBH")
WP_SIZE = _WP.size
INFO_SIZE = _INFO.size
NAV_STATUS_SIZE = _STATUS.size
#: MSP_NAV_CONFIG in MultiWii 2.4, and the limits, after two bytes of flags and the waypoint radius.
NAV_CONFIG_SIZE = 22
_LIMITS_AT, _LIMITS = 2, struct.Struct("<HHH")
_HIGHEST_NUMBER = 254

#: The flag of the last record of a mission, and of a leg that INAV flies to home instead.
LAST, FLY_HOME = 0xA5, 0x48


class Nav(IntEnum):
    """Commands. SET_WP, LOAD and SAVE change the mission, the others do not change anything."""

    LOAD = 18
    SAVE = 19
    GETINFO = 20
    WP = 118
    NAV_CONFIG = 122
    SET_WP = 209


class NavAction(IntEnum):
    """The action of a record."""

    WAYPOINT = 1
    POSHOLD_UNLIM = 2
    POSHOLD_TIME = 3
    RTH = 4
    SET_POI = 5
    JUMP = 6
    SET_HEAD = 7
    LAND = 8


#: The time of a POSHOLD_TIME that replaces an endless hold, which INAV lacks: nine hours.
ENDLESS_S = 32767
#: INAV ignores lower speeds, cm/s.
LEAST_SPEED_CMS = 50
#: Actions that fly to a place.
LEGS = frozenset((NavAction.WAYPOINT, NavAction.POSHOLD_UNLIM, NavAction.POSHOLD_TIME, NavAction.LAND))
#: Actions that only turn the craft.
TURNS = frozenset((NavAction.SET_POI, NavAction.SET_HEAD))


class UnsafeRecord(ValueError):
    """A record that must never be sent."""


@dataclass(frozen=True, slots=True)
class NavRecord:
    """One record. The number is the position in the list, counted from 1.

    lat_e7, lon_e7: degrees * 1e7. alt_cm: above home, or above mean sea level if bit 0 of p3 is set. `flag` is LAST for
    the last record. `action` is a plain int because a flight controller may have an unknown number.
    """

    action: int
    lat_e7: int = 0
    lon_e7: int = 0
    alt_cm: int = 0
    p1: int = 0
    p2: int = 0
    p3: int = 0
    flag: int = 0

    def pack(self) -> bytes:
        """The 20 bytes after the number. Raises struct.error if a field does not fit, which is a bug in the caller."""
        return _BODY.pack(self.action, self.lat_e7, self.lon_e7, self.alt_cm, self.p1, self.p2, self.p3, self.flag)


@dataclass(frozen=True, slots=True)
class NavInfo:
    """MSP_WP_GETINFO: the capacity, the validity of the current list, and the size."""

    capacity: int
    is_valid: bool
    count: int


class NavMode(IntEnum):
    """The modes in MSP_NAV_STATUS while a mission is flown."""

    HOLD = 1
    RTH = 2
    MISSION = 3


class NavState(IntEnum):
    """The states in MSP_NAV_STATUS. The last three are INAV's."""

    RTH_START = 1
    RTH_ENROUTE = 2
    HOLD_TIMED = 4
    WP_ENROUTE = 5
    LAND_START = 8
    LAND_IN_PROGRESS = 9
    LANDED = 10
    LAND_SETTLE = 11
    LAND_START_DESCENT = 12
    HOVER_ABOVE_HOME = 13
    EMERGENCY_LANDING = 14
    RTH_CLIMB = 15


#: States of a craft that lands, or has landed.
LANDING = frozenset(
    (
        NavState.LAND_START,
        NavState.LAND_IN_PROGRESS,
        NavState.LANDED,
        NavState.LAND_SETTLE,
        NavState.LAND_START_DESCENT,
        NavState.EMERGENCY_LANDING,
    )
)
#: MSP_NAV_STATUS, error: "end flag detected, navigation finished".
FINISHED = 4


@dataclass(frozen=True, slots=True)
class NavStatus:
    """MSP_NAV_STATUS: `number` is the current record, counted from 1; heading in degrees.

    `mode`, `state` and `error` are plain ints: newer firmware may send unknown values.
    """

    mode: int
    state: int
    action: int
    number: int
    error: int
    heading_deg: int


def encode_set_wp(number: int, record: NavRecord) -> bytes:
    """The request that stores record `number`; UnsafeRecord if it must not reach a flight controller.

    INAV crashes on a JUMP whose target is below 1, on the ground and in the air.
    """
    if not 1 <= number <= _HIGHEST_NUMBER:
        raise UnsafeRecord(f"number {number} is not a mission record")
    if record.action == NavAction.JUMP and record.p1 <= 0:
        raise UnsafeRecord(f"record {number} jumps to {record.p1}")
    return request(Nav.SET_WP, bytes((number,)) + record.pack())


def encode_read_wp(number: int) -> bytes:
    return request(Nav.WP, bytes((number,)))


#: Reads the number of the selected mission in INAV's store, from 1: a setting, over MSP v2.
SETTING = 0x1003
SELECTED_REQUEST = request(SETTING, b"nav_wp_multi_mission_index\0")
#: The one request of the bridge that changes a flight.
SET_WP_INDEX = 0x2221
#: SAVE and LOAD have one reserved byte; INAV refuses any other length.
SAVE_REQUEST = request(Nav.SAVE, b"\0")
LOAD_REQUEST = request(Nav.LOAD, b"\0")


def encode_fly_to(number: int) -> bytes:
    """The request that makes an INAV in waypoint mode fly to record `number` of the mission (INAV 9.1)."""
    return request(SET_WP_INDEX, bytes((number - 1,)))


def decode_wp(payload: bytes) -> tuple[int, NavRecord] | None:
    """Read MSP_WP: number and record. INAV counts down in p3 of a JUMP during flight, so that is ignored."""
    if len(payload) < _WP.size:
        return None
    number, *fields = _WP.unpack_from(payload)
    record = NavRecord(*fields)
    return number, replace(record, p3=0) if record.action == NavAction.JUMP else record


def decode_info(payload: bytes) -> NavInfo | None:
    if len(payload) < _INFO.size:
        return None
    _, capacity, is_valid, count = _INFO.unpack_from(payload)
    return NavInfo(capacity, bool(is_valid), count)


def decode_nav_config(payload: bytes) -> int | None:
    """Read the capacity in records from MultiWii's MSP_NAV_CONFIG: the last byte but one."""
    return payload[-2] if len(payload) >= 2 else None


def decode_nav_limits(payload: bytes) -> tuple[int, int, int] | None:
    """Read MultiWii's MSP_NAV_CONFIG: wp_radius in cm, safe_wp_distance and nav_max_altitude in metres."""
    if len(payload) < _LIMITS_AT + _LIMITS.size:
        return None
    radius_cm, distance_m, height_m = _LIMITS.unpack_from(payload, _LIMITS_AT)
    return radius_cm, distance_m, height_m


def decode_nav_status(payload: bytes) -> NavStatus | None:
    return NavStatus(*_STATUS.unpack_from(payload)) if len(payload) >= _STATUS.size else None
