# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own telemetry over MSP v2 (src/main/fc/fc_msp.c; layouts seen on INAV 9.1.0's simulator).

A payload that is too short gives None.
"""

import struct
from dataclasses import dataclass

from protocols.msp.telemetry import Sensor

_STATUS = struct.Struct("<HHHHBIQ")
_ANALOG = struct.Struct("<BHhiiiIBH")
_AIRSPEED = struct.Struct("<I")
_RTC = struct.Struct("<IH")
_PLATFORM_AT = 3
STATUS_SIZE = 22
ANALOG_SIZE = _ANALOG.size
AIRSPEED_SIZE = _AIRSPEED.size
RTC_SIZE = _RTC.size
MIXER = 0x2010
MIXER_SIZE = 9
_ALL_SENSORS = sum(Sensor)

#: The flags of MSP2_INAV_STATUS that prevent arming (fc/runtime_config.h), with their texts for the pilot.
ARMING_BLOCKERS = {
    6: "geozone",
    7: "failsafe",
    8: "not level",
    9: "sensors calibrating",
    10: "system overloaded",
    11: "navigation unsafe",
    12: "compass not calibrated",
    13: "accelerometer not calibrated",
    14: "arm switch on",
    15: "hardware failure",
    16: "failsafe switch on",
    18: "no RC link",
    19: "throttle not low",
    20: "command line open",
    21: "CMS menu open",
    22: "OSD menu open",
    23: "sticks not centred",
    24: "servo autotrim on",
    25: "out of memory",
    26: "invalid setting",
    27: "PWM output error",
    28: "prearm switch off",
    29: "DShot beeper",
    30: "landing detected",
}


@dataclass(frozen=True, slots=True)
class InavStatus:
    """MSP2_INAV_STATUS. load_percent: of the CPU. blockers: the reasons that prevent arming. box_flags: 64 bits."""

    cycle_time_us: int
    i2c_errors: int
    sensors: Sensor
    load_percent: int
    blockers: tuple[str, ...]
    box_flags: int


@dataclass(frozen=True, slots=True)
class InavAnalog:
    """MSP2_INAV_ANALOG. rssi: 0..1023. cells: 0 without a battery. Current and consumption may be negative."""

    cells: int
    battery_cv: int
    current_ca: int
    drawn_mah: int
    percent: int
    rssi: int


def decode_inav_status(payload: bytes) -> InavStatus | None:
    if len(payload) < _STATUS.size:
        return None
    cycle_us, i2c_errors, sensors, load, _, flags, box_flags = _STATUS.unpack_from(payload)
    blockers = tuple(name for bit, name in ARMING_BLOCKERS.items() if flags >> bit & 1)
    return InavStatus(cycle_us, i2c_errors, Sensor(sensors & _ALL_SENSORS), min(load, 100), blockers, box_flags)


def decode_inav_analog(payload: bytes) -> InavAnalog | None:
    if len(payload) < _ANALOG.size:
        return None
    battery, volts, current, _, drawn, _, _, percent, rssi = _ANALOG.unpack_from(payload)
    return InavAnalog(battery >> 4, volts, current, drawn, min(percent, 100), rssi)


def decode_airspeed(payload: bytes) -> int | None:
    """Decode MSP2_INAV_AIR_SPEED: cm/s."""
    return int(_AIRSPEED.unpack_from(payload)[0]) if len(payload) >= _AIRSPEED.size else None


def decode_rtc(payload: bytes) -> float | None:
    """Decode MSP_RTC: UTC, seconds since 1970, 0 until INAV has it from the GPS."""
    if len(payload) < _RTC.size:
        return None
    seconds, millis = _RTC.unpack_from(payload)
    return float(seconds + millis / 1000)


def decode_platform(payload: bytes) -> int | None:
    """The platform type in MSP2_INAV_MIXER."""
    return payload[_PLATFORM_AT] if len(payload) > _PLATFORM_AT else None
