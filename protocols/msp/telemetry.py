"""Replies that carry the vehicle's state. Harakiri's lengths are the least accepted; its relatives send longer ones.

Layouts: harakiri.md "Commands answered", inav.md. A payload that is too short gives None.
"""

import struct
from dataclasses import dataclass

_IDENT = struct.Struct("<BBBI")
_STATUS = struct.Struct("<HHHIB")
_RAW_GPS = struct.Struct("<BBiiHH")
_ATTITUDE = struct.Struct("<hhh")
_ALTITUDE = struct.Struct("<ih")
_ANALOG = struct.Struct("<BHH")
_WP = struct.Struct("<Bii")


@dataclass(frozen=True, slots=True)
class Ident:
    """MSP_IDENT: `version` is 211 on Harakiri, `mixer` MultiWii's MULTITYPE number."""

    version: int
    mixer: int
    msp_version: int
    capability: int


@dataclass(frozen=True, slots=True)
class StatusReport:
    """MSP_STATUS: `box_flags` has one bit a box, in the order of BOXNAMES."""

    cycle_time_us: int
    i2c_errors: int
    sensors: int
    box_flags: int


@dataclass(frozen=True, slots=True)
class RawGps:
    """MSP_RAW_GPS: degrees * 1e7, metres above sea level, cm/s; ground course in 0.1 degrees where it is sent."""

    has_fix: bool
    satellites: int
    lat_e7: int
    lon_e7: int
    altitude_m: int
    speed_cms: int
    course_ddeg: int | None


@dataclass(frozen=True, slots=True)
class Attitude:
    """MSP_ATTITUDE: roll and pitch in 0.1 degrees, heading in degrees (-180..180 on Harakiri)."""

    roll_ddeg: int
    pitch_ddeg: int
    heading_deg: int


@dataclass(frozen=True, slots=True)
class Altitude:
    """MSP_ALTITUDE: estimated height above the launch point in cm, climb in cm/s."""

    height_cm: int
    climb_cms: int


@dataclass(frozen=True, slots=True)
class Analog:
    """MSP_ANALOG: battery in 0.1 V, receiver strength 0..1023."""

    battery_dv: int
    power: int
    rssi: int


@dataclass(frozen=True, slots=True)
class HomePoint:
    """MSP_WP number 0: where the flight controller took off, degrees * 1e7; 0, 0 if it does not know."""

    lat_e7: int
    lon_e7: int


def decode_ident(payload: bytes) -> Ident | None:
    """Read MSP_IDENT."""
    return Ident(*_IDENT.unpack_from(payload)) if len(payload) >= _IDENT.size else None


def decode_status(payload: bytes) -> StatusReport | None:
    """Read MSP_STATUS."""
    return StatusReport(*_STATUS.unpack_from(payload)[:4]) if len(payload) >= _STATUS.size else None


def decode_raw_gps(payload: bytes) -> RawGps | None:
    """Read MSP_RAW_GPS."""
    if len(payload) < _RAW_GPS.size:
        return None
    fix, satellites, lat, lon, altitude, speed = _RAW_GPS.unpack_from(payload)
    course = int.from_bytes(payload[14:16], "little") if len(payload) >= 16 else None
    return RawGps(bool(fix), satellites, lat, lon, altitude, speed, course)


def decode_attitude(payload: bytes) -> Attitude | None:
    """Read MSP_ATTITUDE."""
    return Attitude(*_ATTITUDE.unpack_from(payload)) if len(payload) >= _ATTITUDE.size else None


def decode_altitude(payload: bytes) -> Altitude | None:
    """Read MSP_ALTITUDE."""
    return Altitude(*_ALTITUDE.unpack_from(payload)) if len(payload) >= _ALTITUDE.size else None


def decode_analog(payload: bytes) -> Analog | None:
    """Read MSP_ANALOG."""
    return Analog(*_ANALOG.unpack_from(payload)) if len(payload) >= _ANALOG.size else None


def decode_home(payload: bytes) -> HomePoint | None:
    """Read MSP_WP number 0."""
    if len(payload) < _WP.size or payload[0] != 0:
        return None
    return HomePoint(*_WP.unpack_from(payload)[1:])


def decode_box_names(payload: bytes) -> tuple[str, ...]:
    """Read MSP_BOXNAMES: names in the order of the status bits."""
    return tuple(payload.decode("ascii", "replace").rstrip(";").split(";")) if payload else ()
