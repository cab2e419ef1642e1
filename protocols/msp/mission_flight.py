# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress of a mission that the board flies: FLIGHT of Harakiri's mission extension (docs/msp-mission.md)."""

import struct
from dataclasses import dataclass, replace
from enum import IntEnum

from protocols.msp.commands import Msp
from protocols.msp.frame import request

FLIGHT = Msp.FLIGHT
FLIGHT_REQUEST = request(FLIGHT)
_VERSION = 2
_NO_RECORD = 0xFFFF
_REPLY = struct.Struct("<6B3HIHhIh")
FLIGHT_SIZE = _REPLY.size
#: The name of a NAMED_VALUE_INT in Harakiri's own MAVLink, with state, reason, flags and record in its four bytes.
SUMMARY = "flight"
_SIGNED, _NO_SHORT_RECORD = struct.Struct("<i"), 0xFF
_IN_COMMAND, _BATTERY_LOW, _SWITCH_ON, _ENABLED, _COMPASS_KNOWN = 4, 8, 2, 1, 16


class FlightPhase(IntEnum):
    """The states of firmware/naze_flight.h, in order."""

    OFF = 0
    CHECK = 1
    NEXT = 2
    WAIT = 3
    LIFT = 4
    RISE = 5
    CLIMB = 6
    LEG = 7
    LOITER = 8
    TURN = 9
    STAY = 10
    SETTLE = 11
    DESCENT = 12
    SINK = 13
    DONE = 14
    HELD = 15
    NO_FIX = 16
    HOME = 17


class FlightReason(IntEnum):
    """Why a flight did not start, stopped, or is slow."""

    NONE = 0
    DISABLED = 1
    NOT_ARMED = 2
    FIX_MISSING = 3
    HOME_MISSING = 4
    NOT_READY = 5
    LIST_EMPTY = 6
    LIST_DAMAGED = 7
    LIST_CHANGED = 8
    BAD_ORDER = 9
    BAD_PLACE = 10
    FIRST_FAR = 11
    LEG_LONG = 12
    TOO_HIGH = 13
    ON_GROUND = 14
    THROTTLE_LOW = 15
    NO_LIFT = 16
    CLIMB_SLOW = 17
    STALLED = 18
    TURN_SLOW = 19
    LAND_SLOW = 20
    STICKS = 21
    THROTTLE = 22
    FIX_LOST = 23
    RTL = 24
    FAILSAFE = 25
    SWITCHED_OFF = 26
    DISARMED = 27
    FLOWN = 28
    AWAY = 29
    COMPASS = 30
    HOLD_LOST = 31
    BLIND = 32
    FENCE = 33
    BATTERY = 34
    JUMP = 35


@dataclass(frozen=True, slots=True)
class FlightProgress:
    """Reply to FLIGHT. `record` is in flight, or was left or refused; metres and degrees; `height_error` is up."""

    state: FlightPhase = FlightPhase.OFF
    reason: FlightReason = FlightReason.NONE
    is_enabled: bool = True
    switch_on: bool = False
    in_command: bool = False
    battery_low: bool = False
    record: int | None = None
    reached: int | None = None
    distance: float = 0.0
    bearing: float = 0.0
    height_error: float = 0.0
    state_s: float = 0.0
    #: How far the compass points too far clockwise, degrees, or None if not measured yet, or not told.
    compass: float | None = None

    @property
    def summary(self) -> int:
        """The value of Harakiri's MAVLink message SUMMARY."""
        flags = self.is_enabled, self.switch_on, self.in_command, self.battery_low, self.compass is not None
        record = _NO_SHORT_RECORD if self.record is None else self.record
        flag_bits = sum(1 << bit for bit, is_set in enumerate(flags) if is_set)
        (summary,) = _SIGNED.unpack(bytes((self.state, self.reason, flag_bits, record)))
        return int(summary)


def decode_flight(payload: bytes) -> FlightProgress | None:
    """Read a reply. Returns None if it is truncated, an error, or of another version."""
    if len(payload) < _REPLY.size:
        return None
    status, version, flags, state, reason, _, record, reached, _, *motion = _REPLY.unpack_from(payload)
    distance, bearing, height_error, state_ms, compass = motion
    progress = None if status or version != _VERSION else _progress(state, reason, flags)
    if progress is None:
        return None
    return replace(
        progress,
        record=None if record == _NO_RECORD else record,
        reached=None if reached == _NO_RECORD else reached,
        distance=distance / 100,
        bearing=bearing / 100,
        height_error=height_error / 100,
        state_s=state_ms / 1000,
        compass=compass / 100 if flags & _COMPASS_KNOWN else None,
    )


def decode_summary(summary: int) -> FlightProgress | None:
    """Read SUMMARY: the rest is unknown, and left at the default. Returns None if it is of another version."""
    state, reason, flags, record = _SIGNED.pack(summary)
    progress = _progress(state, reason, flags)
    return None if progress is None else replace(progress, record=None if record == _NO_SHORT_RECORD else record)


def _progress(state: int, reason: int, flags: int) -> FlightProgress | None:
    if state > max(FlightPhase) or reason > max(FlightReason):
        return None
    return FlightProgress(
        state=FlightPhase(state),
        reason=FlightReason(reason),
        is_enabled=bool(flags & _ENABLED),
        switch_on=bool(flags & _SWITCH_ON),
        in_command=bool(flags & _IN_COMMAND),
        battery_low=bool(flags & _BATTERY_LOW),
    )
