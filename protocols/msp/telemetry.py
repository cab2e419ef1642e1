# SPDX-License-Identifier: GPL-3.0-or-later
"""Replies with the vehicle's state. Harakiri's lengths are the minimum. Related firmware sends longer replies.

Layouts: Harakiri's serial.c; INAV's fc_msp.c. A payload that is too short gives None.
"""

import struct
from enum import IntFlag
from typing import NamedTuple

from protocols.plain_text import PlainText, plain_text

_IDENT = struct.Struct("<BBBI")
_STATUS = struct.Struct("<HHHIB")
STATUS_SIZE = _STATUS.size
_RAW_GPS = struct.Struct("<BBiihH")
_ATTITUDE = struct.Struct("<hhh")
_ALTITUDE = struct.Struct("<ih")
_ANALOG = struct.Struct("<BHH")
_ANALOG_WITH_CURRENT = struct.Struct("<BHHh")
_ANALOG_WITH_VOLTAGE = struct.Struct("<BHHhH")
_WP = struct.Struct("<Bii")
_PLACE = struct.Struct("<ii")
_NAV_WP_SIZE = 21
_MIN_CHANNELS, _MAX_CHANNELS = 4, 18


class Sensor(IntFlag):
    """Bits of MSP_STATUS: the sensors that are fitted and respond. The same on all firmware."""

    ACCELEROMETER = 1
    BAROMETER = 2
    COMPASS = 4
    GPS = 8
    SONAR = 16


class Ident(NamedTuple):
    """MSP_IDENT: `version` is 211 on Harakiri, `mixer` MultiWii's MULTITYPE number."""

    version: int
    mixer: int
    msp_version: int
    capability: int

    @property
    def release(self) -> tuple[int, int, int]:
        """The version as MultiWii and its descendants count: 241 is 2.4.1."""
        return self.version // 100, self.version // 10 % 10, self.version % 10


class StatusReport(NamedTuple):
    """MSP_STATUS: `box_flags` has one bit per box, in the order of BOXNAMES."""

    cycle_time_us: int
    i2c_errors: int
    sensors: Sensor
    box_flags: int


class RawGps(NamedTuple):
    """MSP_RAW_GPS: degrees * 1e7, metres above sea level, cm/s; course in 0.1 degrees and HDOP * 100 where sent.

    `fix` is 0 or 1. INAV's is 0, 1 (two dimensions) or 2 (three).
    """

    fix: int
    satellites: int
    lat_e7: int
    lon_e7: int
    altitude_m: int
    speed_cms: int
    course_ddeg: int | None = None
    hdop_e2: int | None = None


class Analog(NamedTuple):
    """MSP_ANALOG: receiver strength 0..1023. MAh drawn and current (0.01 A, on MultiWii 0.1 A) where they are sent.

    A missing sensor reads 0. Where the voltage has only one byte, it ends at 25.5 V.
    """

    battery_v: float
    rssi: int
    drawn_mah: int | None = None
    current: int | None = None


def decode_ident(payload: bytes) -> Ident | None:
    return Ident(*_IDENT.unpack_from(payload)) if len(payload) >= _IDENT.size else None


def decode_status(payload: bytes) -> StatusReport | None:
    if len(payload) < _STATUS.size:
        return None
    cycle_time, i2c_errors, sensors, box_flags, _ = _STATUS.unpack_from(payload)
    return StatusReport(cycle_time, i2c_errors, Sensor(sensors), box_flags)


def decode_channels(payload: bytes) -> tuple[int, ...] | None:
    """Read MSP_RC: roll, pitch, yaw, throttle, then aux, microseconds; at most 18."""
    count = len(payload) // 2
    if count < _MIN_CHANNELS:
        return None
    return struct.unpack_from(f"<{min(count, _MAX_CHANNELS)}H", payload)


def decode_raw_gps(payload: bytes) -> RawGps | None:
    if len(payload) < _RAW_GPS.size:
        return None
    fix, satellites, lat, lon, altitude, speed = _RAW_GPS.unpack_from(payload)
    course = int.from_bytes(payload[14:16], "little") if len(payload) >= 16 else None
    hdop = int.from_bytes(payload[16:18], "little") if len(payload) >= 18 else None
    return RawGps(fix, satellites, lat, lon, altitude, speed, course, hdop)


def decode_attitude(payload: bytes) -> tuple[int, int, int] | None:
    """Read MSP_ATTITUDE: roll and pitch in 0.1 degrees, heading in degrees.

    Right wing down and nose down are positive on all firmware. Harakiri's and baseflight's heading is -180..180, the
    others' 0..360.
    """
    return _ATTITUDE.unpack_from(payload) if len(payload) >= _ATTITUDE.size else None


def decode_altitude(payload: bytes) -> tuple[int, int] | None:
    """Read MSP_ALTITUDE: estimated height above the launch point in cm, climb in cm/s."""
    return _ALTITUDE.unpack_from(payload) if len(payload) >= _ALTITUDE.size else None


def decode_analog(payload: bytes) -> Analog | None:
    """Read MSP_ANALOG: 5 bytes on Harakiri, whose second field is always 0; 7 elsewhere; 9 on Betaflight."""
    if len(payload) < _ANALOG.size:
        return None
    battery_dv, drawn, rssi = _ANALOG.unpack_from(payload)
    if len(payload) < _ANALOG_WITH_CURRENT.size:
        return Analog(battery_dv / 10, rssi)
    *_, current = _ANALOG_WITH_CURRENT.unpack_from(payload)
    if len(payload) < _ANALOG_WITH_VOLTAGE.size:
        return Analog(battery_dv / 10, rssi, drawn, current)
    *_, battery_cv = _ANALOG_WITH_VOLTAGE.unpack_from(payload)
    return Analog(battery_cv / 100, rssi, drawn, current)


def decode_home(payload: bytes) -> tuple[int, int] | None:
    """Read MSP_WP number 0: home, degrees * 1e7; 0 or 190 degrees if unknown.

    In the 21 bytes of INAV and MultiWii NAV an action follows the number.
    """
    if len(payload) < _WP.size or payload[0] != 0:
        return None
    has_action = len(payload) >= _NAV_WP_SIZE
    return _PLACE.unpack_from(payload, 2 if has_action else 1)


def decode_box_names(payload: bytes) -> tuple[PlainText, ...]:
    """Read MSP_BOXNAMES: names in the order of the status bits."""
    return tuple(map(plain_text, payload.rstrip(b";").split(b";"))) if payload else ()


def decode_box_activation(payload: bytes, boxes: int) -> tuple[int, ...] | None:
    """Read MSP_BOX: for each box a word with three bits per aux channel; 32 bits wide above four channels."""
    if not boxes or len(payload) not in (2 * boxes, 4 * boxes):
        return None
    return struct.unpack(f"<{boxes}{'H' if len(payload) == 2 * boxes else 'I'}", payload)
