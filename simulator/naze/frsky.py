# SPDX-License-Identifier: GPL-3.0-or-later
"""FrSky hub telemetry as Harakiri sends it while armed with tele_prot 1, with a battery and a GPS (telemetry.c)."""

import math
import struct

from simulator.board.flight import FlightState

PERIOD_SECONDS = 0.125
#: Periods of each group of values.
_HEIGHT, _POWER_AND_PLACE, _TIME = 4, 8, 40
_MARK = b"\x5e"
_ESCAPED = {0x5E: b"\x5d\x3e", 0x5D: b"\x5d\x3d"}
_TEMPERATURE, _CELL = 0x02, 0x06
_ALTITUDE_M, _ALTITUDE_CM = 0x10, 0x21
_HEADING, _HEADING_FRACTION = 0x14, 0x1C
_LATITUDE, _LONGITUDE = (0x13, 0x1B, 0x23), (0x12, 0x1A, 0x22)
_MINUTES, _SECONDS = 0x17, 0x18
_ACCELERATION = (0x24, 0x25, 0x26)
_VOLTS, _DECIVOLTS = 0x3A, 0x3B
_CELLS = 3
#: The gyro's, in tens of degrees.
_WARM = 3


def frames(flight: FlightState, number: int, uptime: float) -> bytes:
    """The frames of the `number`th period, from 1, each a group of values."""
    groups = [list(zip(_ACCELERATION, _gravity_mg(flight), strict=True))]
    if number % _HEIGHT == 0:
        # Harakiri truncates fractions, even of a heading of -180..180.
        height_cm = max(int(flight.height_m * 100), 0)
        height = [(_ALTITUDE_M, height_cm // 100), (_ALTITUDE_CM, height_cm % 100)]
        heading = int((flight.heading + 180) % 360 - 180) % 360
        groups.append([*height, (_HEADING, heading), (_HEADING_FRACTION, 0)])
    if number % _POWER_AND_PLACE == 0:
        volts_dv = round(flight.volts * 10)
        scaled = volts_dv * 110 // 21
        cell = volts_dv // _CELLS * 2100 // 42
        cell_value = (number // _POWER_AND_PLACE - 1) % _CELLS << 4 | (cell & 0xFF) << 8 | cell >> 8 & 0xF
        power = [(_CELL, cell_value), (_VOLTS, scaled // 100), (_DECIVOLTS, (scaled % 100 + 5) // 10)]
        place = _angle(_LATITUDE, flight.lat_e7, b"NS") + _angle(_LONGITUDE, flight.lon_e7, b"EW")
        groups.append([(_TEMPERATURE, _WARM), *power, *place])
    if number % _TIME == 0:
        groups.append([(_MINUTES, int(uptime) // 60 % 60 << 8), (_SECONDS, int(uptime) % 60)])
    return b"".join(b"".join(_value(identifier, value) for identifier, value in group) + _MARK for group in groups)


def _gravity_mg(flight: FlightState) -> tuple[int, int, int]:
    roll, pitch = math.radians(flight.roll), math.radians(flight.pitch)
    level = math.cos(pitch)
    return (
        int(1000 * level * math.sin(roll)),
        int(1000 * math.sin(pitch)),
        int(1000 * level * math.cos(roll)),
    )


def _angle(identifiers: tuple[int, int, int], angle_e7: int, letters: bytes) -> list[tuple[int, int]]:
    """Degrees and minutes as dddmm, the minutes' next four digits, and N, S, E or W."""
    degrees, rest = divmod(abs(angle_e7), 10_000_000)
    minutes, fraction = divmod(rest * 60, 10_000_000)
    return list(zip(identifiers, (degrees * 100 + minutes, fraction // 1000, letters[angle_e7 < 0]), strict=True))


def _value(identifier: int, value: int) -> bytes:
    data = struct.pack("<H", value & 0xFFFF)
    return _MARK + bytes((identifier,)) + b"".join(_ESCAPED.get(byte, bytes((byte,))) for byte in data)
