# SPDX-License-Identifier: GPL-3.0-or-later
"""FrSky hub telemetry as Harakiri sends it while armed with tele_prot 1 (telemetry.c)."""

import struct

from simulator.flight import FlightState

PERIOD_SECONDS = 0.125
_MARK = b"\x5e"
_ESCAPED = {0x5E: b"\x5d\x3e", 0x5D: b"\x5d\x3d"}
_ALTITUDE_M, _ALTITUDE_CM = 0x10, 0x21
_COURSE = 0x14
_ACCELERATION = (0x24, 0x25, 0x26)
_VOLTS, _DECIVOLTS = 0x3A, 0x3B


def frame(flight: FlightState, number: int) -> bytes:
    """The frame of the `number`th period: acceleration, every fourth time also height, course and battery."""
    sent = [(identifier, value) for identifier, value in zip(_ACCELERATION, (0, 0, 1000), strict=True)]
    if number % 4 == 0:
        sent += [(_ALTITUDE_M, int(flight.height_m)), (_ALTITUDE_CM, int(flight.height_m * 100) % 100)]
        sent += [(_COURSE, round(flight.course))]
        sent += [(_VOLTS, int(flight.volts)), (_DECIVOLTS, int(flight.volts * 10) % 10)]
    return b"".join(_value(identifier, value) for identifier, value in sent) + _MARK


def _value(identifier: int, value: int) -> bytes:
    data = struct.pack("<h", value)
    return _MARK + bytes((identifier,)) + b"".join(_ESCAPED.get(byte, bytes((byte,))) for byte in data)
