# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's MAVLink 1 stream: the messages, schedule and ids (baseflight_mavlink.c).

Payloads are packed here and not by pymavlink, because the firmware sends them without MAVLink 2's extra fields.
"""

import math
import struct
from collections.abc import Callable
from enum import Enum
from functools import lru_cache

from protocols.mavlink.codec import FrameWriter, Packed
from simulator.board.flight import Craft
from simulator.board.transmitter import channels_us

_SYSID = 1
_COMPID = 200
_QUADROTOR = 2
_ARDUPILOTMEGA = 3
_MAVLINK_VERSION = 3
_MODE_MANUAL_DISARMED, _MODE_STABILIZE_DISARMED = 64, 80
#: The boxes ANGLE and HORIZON.
_LEVEL_BOXES = 0b11
_MODE_ARMED = 128
_STATE_STANDBY, _STATE_ACTIVE = 3, 4
_FIX_3D = 3
_UNKNOWN = 65535
_SENSORS = 35843 | 4100 | 8200 | 16416
_SENSORS_HEALTHY = _SENSORS & 1023
_RSSI = 230

#: The stream has slots of 10 ms. A message is sent in each slot whose number its divisor divides, one per slot.
SLOT_SECONDS = 0.010


class Stream(Enum):
    """The messages of the stream: divisor (the first that divides wins), message id, payload layout.

    PARAM_VALUE has its slots only while the parameters are listed; simulator.naze.parameters fills it.
    """

    SCALED_PRESSURE = (199, 29, "<Iffh")
    HEARTBEAT = (101, 0, "<IBBBBB")
    SYS_STATUS = (53, 1, "<IIIHHhHHHHHHb")
    GPS_RAW_INT = (47, 24, "<QiiiHHHHBB")
    RC_CHANNELS_RAW = (43, 35, "<IHHHHHHHHBB")
    VFR_HUD = (11, 74, "<ffffhH")
    PARAM_VALUE = (10, 22, "")
    ATTITUDE = (3, 30, "<Iffffff")


@lru_cache(1024)  # each main loop asks
def _slots_to_next(slot: int, only_heartbeat: bool) -> int:
    """The number of slots from `slot` to the next one with a message."""
    messages = (Stream.HEARTBEAT,) if only_heartbeat else Stream
    return min(divisor - slot % divisor for divisor, *_ in (message.value for message in messages))


class MavlinkSchedule:
    """The schedule of messages. `only_heartbeat`: the firmware is in AUTOSENSE. `of_flight`: a slot's own message."""

    def __init__(self, now: float, of_flight: Callable[[int], Packed | None]) -> None:
        self._of_flight = of_flight
        self._slot = 0
        self._time = now

    def resume(self, now: float) -> None:
        """Continue from `now`, after a time without calls by the firmware."""
        self._time = now

    def next_due(self, only_heartbeat: bool) -> float:
        """The time of the next message."""
        return self._time + SLOT_SECONDS * _slots_to_next(self._slot, only_heartbeat)

    def take_due(self, now: float, only_heartbeat: bool, is_listing: bool) -> list[Stream | Packed]:
        due: list[Stream | Packed] = []
        while self._time + SLOT_SECONDS <= now + 1e-9:
            self._time += SLOT_SECONDS
            self._slot = (self._slot + 1) & 0xFFFF
            if message := self._message(self._slot, only_heartbeat, is_listing):
                due.append(message)
        return due

    def _message(self, slot: int, only_heartbeat: bool, is_listing: bool) -> Stream | Packed | None:
        if only_heartbeat:
            return None if slot % Stream.HEARTBEAT.value[0] else Stream.HEARTBEAT
        possible = (message for message in Stream if is_listing or message is not Stream.PARAM_VALUE)
        first = next((message for message in possible if slot % message.value[0] == 0), None)
        of_flight = None if first in (Stream.SCALED_PRESSURE, Stream.HEARTBEAT) else self._of_flight(slot)
        return of_flight or first


class MavlinkSender:
    """Packs frames with a running sequence number."""

    def __init__(self) -> None:
        self._writer = FrameWriter(_SYSID, _COMPID)

    def telemetry(self, message: Stream, craft: Craft, uptime: float) -> bytes:
        """Encode a message with the current values; `uptime` in seconds."""
        _, msgid, layout = message.value
        payload = struct.pack(layout, *_fields(message, craft, round(uptime * 1000)))
        return self.frame(Packed(msgid, payload, payload))

    def frame(self, packed: Packed) -> bytes:
        return self._writer.frame(packed, 1)


def _fields(message: Stream, craft: Craft, uptime_ms: int) -> tuple[float, ...]:
    """A message's fields in wire order."""
    flight, armed = craft.flight, craft.armed
    heading = round(flight.heading) % 360
    throttle = 45 if armed else 0
    match message:
        case Stream.SCALED_PRESSURE:
            return uptime_ms, 1013.25 - flight.altitude_m * 0.12, 0.0, 3200
        case Stream.HEARTBEAT:
            mode = _MODE_STABILIZE_DISARMED if craft.boxes & _LEVEL_BOXES else _MODE_MANUAL_DISARMED
            mode |= _MODE_ARMED if armed else 0
            state = _STATE_ACTIVE if armed else _STATE_STANDBY
            return 0, _QUADROTOR, _ARDUPILOTMEGA, mode, state, _MAVLINK_VERSION
        case Stream.SYS_STATUS:
            millivolts = round(flight.volts * 10) * 100
            sensors = (_SENSORS, _SENSORS, _SENSORS_HEALTHY)
            return *sensors, 0, millivolts, -1, 0, 0, 0, 0, 0, 0, -1
        case Stream.GPS_RAW_INT:
            position = (flight.lat_e7, flight.lon_e7, round(flight.altitude_m) * 1000)
            course = round(flight.course * 100) % 36000
            motion = (round(flight.speed_ms * 100), course)
            return uptime_ms * 1000, *position, _UNKNOWN, _UNKNOWN, *motion, _FIX_3D, flight.satellites
        case Stream.RC_CHANNELS_RAW:
            roll, pitch, yaw, throttle_us, *aux = channels_us(armed, craft.boxes)
            return uptime_ms, roll, pitch, throttle_us, yaw, *aux, 0, _RSSI
        case Stream.PARAM_VALUE:
            return ()
        case Stream.VFR_HUD:
            return 0.0, flight.speed_ms, flight.height_m, flight.climb_ms, heading, throttle
        case Stream.ATTITUDE:
            # The firmware's pitch is nose-down positive, and it does not send rates.
            angles = (math.radians(flight.roll), -math.radians(flight.pitch), math.radians(flight.heading))
            return uptime_ms, *angles, 0.0, 0.0, 0.0
