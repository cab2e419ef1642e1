# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's settings by name or index, and its PIDs, modes, rates and MISC, from one boot to the next (fc_msp.c)."""

import struct

from protocols.msp.inav_settings import (
    COMMON_SET_SETTING,
    COMMON_SETTING,
    COMMON_SETTING_INFO,
    InavSetting,
    InavType,
    decode_value,
)
from simulator.inav.setting_table import PIDS, SETTINGS

_PIDS = 11
_RANGES, _RANGE_SIZE = 40, 4
_AUX1, _AUX2 = 0, 1
#: Steps of 25 us from 900 us on.
_HIGH = (32, 48)
_ARM, _ANGLE, _NAV_WP = 0, 1, 28

MODE_RANGES, SET_MODE_RANGE, PIDNAMES, UID = 34, 35, 117, 160
INAV_MISC, RATE_PROFILE, SET_RATE_PROFILE, PID_V2, SET_PID_V2, EZ_TUNE = 0x2003, 0x2007, 0x2008, 0x2030, 0x2031, 0x2070
#: Bytes of each value in the EEPROM, after a byte that is set once they were saved.
_STORED_SIZE = 16
SETTINGS_SIZE = 1 + _STORED_SIZE * len(SETTINGS)
_CHECKED_BELOW = (InavType.INT8, InavType.INT16, InavType.FLOAT)
_SETTERS = {SET_PID_V2: PID_V2, SET_RATE_PROFILE: RATE_PROFILE}


class InavSettings:
    """`stored`: SETTINGS_SIZE bytes of the EEPROM. EZ tune, from version 7 on, is off."""

    def __init__(self, stored: memoryview, version: tuple[int, ...]) -> None:
        self._stored = stored
        # One bit further in the table's entries of version 6 (settings.h).
        shift = 0 if version >= (7, 0, 0) else 1
        self._settings = {
            setting.name: setting._replace(
                section=setting.section << shift, value=self._saved_value(setting) if stored[0] else setting.value
            )
            for setting in SETTINGS
        }
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
        if version >= (7, 0, 0):
            snappiness = b"\0" if version >= (8, 0, 0) else b""
            self._replies[EZ_TUNE] = bytes((0, 110, 0, 110, *(100,) * 6)) + snappiness

    def read(self, command: int) -> bytes | None:
        """The payload of a reply, or None for other commands."""
        reply = self._replies.get(command)
        if command == PID_V2 and reply is not None:
            return bytes(int(self._settings[name].value) for name in PIDS) + reply[len(PIDS) :]
        return reply

    def __getitem__(self, name: str) -> float | str:
        return self._settings[name].value

    def __setitem__(self, name: str, value: float | str) -> None:
        self._settings[name] = self._settings[name]._replace(value=value)

    def answer(self, command: int, payload: bytes) -> bytes | None:
        """The payload of the reply to a request about one setting, or None if an error."""
        setting, data = self._find(payload)
        if setting is None:
            return None
        match command:
            case _ if command == COMMON_SETTING:
                return setting.pack()
            case _ if command == COMMON_SETTING_INFO:
                return setting.encode()
            case _ if command == COMMON_SET_SETTING:
                return b"" if self._set(setting, data) else None
        return None

    def save(self) -> None:
        """EEPROM_WRITE."""
        self._stored[0] = 1
        for setting in self._settings.values():
            at = 1 + setting.place * _STORED_SIZE
            packed = setting.pack().ljust(_STORED_SIZE, b"\0")
            self._stored[at : at + _STORED_SIZE] = packed

    def _saved_value(self, setting: InavSetting) -> float | str:
        at = 1 + setting.place * _STORED_SIZE
        stored = bytes(self._stored[at : at + _STORED_SIZE])
        value = _text(stored) if setting.type is InavType.STRING else decode_value(setting.type, stored)
        assert value is not None
        return value

    def _find(self, payload: bytes) -> tuple[InavSetting | None, bytes]:
        """The setting that a request names, by a text or by a zero and its index, and the bytes that follow."""
        name, end, data = payload.partition(b"\0")
        if name or len(data) < 2:
            return self._settings.get(name.decode("ascii", "replace")) if end else None, data
        index = int.from_bytes(data[:2], "little")
        settings = [*self._settings.values()]
        return settings[index] if index < len(settings) else None, data[2:]

    def _set(self, setting: InavSetting, data: bytes) -> bool:
        """An unsigned value below the minimum is accepted. Bytes after the value are ignored."""
        value = decode_value(setting.type, data)
        if value is None:
            return False
        if isinstance(value, str):
            # Written over the old text, followed by a zero.
            new = data[: setting.maximum] + b"\0"
            value = _text((new + setting.pack()[len(new) :])[: setting.maximum])
        elif value > setting.maximum or (value < setting.minimum and setting.type in _CHECKED_BELOW):
            return False
        self[setting.name] = value
        return True

    def write(self, command: int, payload: bytes) -> bool:
        """Carry out a setter. Returns False if it is another command, or the payload has another length."""
        if command == SET_MODE_RANGE and len(payload) == 1 + _RANGE_SIZE and payload[0] < _RANGES:
            ranges = bytearray(self._replies[MODE_RANGES])
            ranges[payload[0] * _RANGE_SIZE : (payload[0] + 1) * _RANGE_SIZE] = payload[1:]
            self._replies[MODE_RANGES] = bytes(ranges)
            return True
        setting = _SETTERS.get(command)
        if setting is None or len(payload) != len(self._replies[setting]):
            return False
        self._replies[setting] = payload
        if command == SET_PID_V2:
            for name, value in zip(PIDS, payload, strict=False):
                self[name] = value
        return True


def _text(stored: bytes) -> str:
    """The whole field of a text: INAV keeps the bytes after the end."""
    return stored.decode("ascii", "replace").rstrip("\0")
