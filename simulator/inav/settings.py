# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's PIDs, modes, rates and MISC, from one boot to the next (fc_msp.c)."""

import struct

_PIDS = 11
_RANGES, _RANGE_SIZE = 40, 4
_AUX1, _AUX2 = 0, 1
#: Steps of 25 us from 900 us on.
_HIGH = (32, 48)
_ARM, _ANGLE, _NAV_WP = 0, 1, 28

MODE_RANGES, SET_MODE_RANGE, PIDNAMES, UID = 34, 35, 117, 160
INAV_MISC, RATE_PROFILE, SET_RATE_PROFILE, PID_V2, SET_PID_V2, EZ_TUNE = 0x2003, 0x2007, 0x2008, 0x2030, 0x2031, 0x2070
_SETTERS = {SET_PID_V2: PID_V2, SET_RATE_PROFILE: RATE_PROFILE}


class InavSettings:
    """`has_ez_tune`: from version 7 on. It is off."""

    def __init__(self, *, has_ez_tune: bool) -> None:
        ranges = b"".join(bytes((box, aux, *_HIGH)) for box, aux in ((_ARM, _AUX1), (_ANGLE, _AUX2), (_NAV_WP, _AUX2)))
        throttles = struct.pack("<5H", 1500, 0, 1850, 1000, 1000)
        battery = struct.pack("<HBBHHHHIIIB", 1100, 0, 0, 425, 330, 420, 350, 2200, 400, 200, 0)
        self._replies = {
            MODE_RANGES: ranges.ljust(_RANGES * _RANGE_SIZE, b"\0"),
            PIDNAMES: b"ROLL;PITCH;YAW;ALT;Pos;PosR;NavR;LEVEL;MAG;VEL;",
            UID: bytes(range(12)),
            INAV_MISC: throttles + struct.pack("<BBBBH", 7, 0, 0, 0, 0) + battery,
            RATE_PROFILE: bytes((50, 0, 0, 0xDC, 5, 70, 20, 20, 20, 20, 35, 20, 100, 100, 100)),
            PID_V2: bytes((40, 30, 23, 60)) * _PIDS,
        }
        if has_ez_tune:
            self._replies[EZ_TUNE] = bytes((0, 110, 0, 100, 100, 100, 100, 100, 100, 0, 0))

    def read(self, command: int) -> bytes | None:
        """The payload of a reply; None for other commands."""
        return self._replies.get(command)

    def write(self, command: int, payload: bytes) -> bool:
        """Carry out a setter; False if it is another command, or its payload has another length."""
        if command == SET_MODE_RANGE and len(payload) == 1 + _RANGE_SIZE and payload[0] < _RANGES:
            ranges = bytearray(self._replies[MODE_RANGES])
            ranges[payload[0] * _RANGE_SIZE : (payload[0] + 1) * _RANGE_SIZE] = payload[1:]
            self._replies[MODE_RANGES] = bytes(ranges)
            return True
        setting = _SETTERS.get(command)
        if setting is None or len(payload) != len(self._replies[setting]):
            return False
        self._replies[setting] = payload
        return True
