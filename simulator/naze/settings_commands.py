# SPDX-License-Identifier: GPL-3.0-or-later
"""A model of harakiri_settings.c: the settings read, set and saved over MSP (docs/msp-mission.md)."""

import struct
from collections.abc import Callable

from protocols.msp.mission import ReplyStatus
from protocols.msp.setting_table import (
    WHOLE_TABLE,
    HeldSetting,
    SettingCommand,
    SettingsReply,
    SettingType,
    TableReply,
    table_checksum,
)
from simulator.naze.missions import Board
from simulator.naze.replies import SETTINGS_SIZE, encode_reply, unmask
from simulator.naze.setting_table import FLIGHT_SETTINGS, SETTINGS

_READ = struct.Struct("<HH")
_SET = struct.Struct("<HI4s")
_NAMES = [held.setting.name for held in SETTINGS]
_RADIUS, _MOTORS_OFF, _SENSOR = (_NAMES.index(name) for name in ("gps_wp_radius", "esc_moff", "acc_hdw"))
_TRIMS = [_NAMES.index(name) for name in ("rc_trm_rll", "rc_trm_ptch")]
_ALIGNMENT = ("align_gyro", "align_acc", "align_mag")
#: A running firmware may crash with another value.
CRASHING = frozenset(name for name in _NAMES if name == "gbl_flg" or name.startswith(_ALIGNMENT))
#: The size of all values in the configuration, bytes.
STORED_SIZE = 4 * len(SETTINGS)


class SettingsCommands:
    """The settings in RAM since boot. `stored`: their values in the configuration, or empty if the defaults.

    Those of mission flight, which a build `has_flight` for, are not stored.
    """

    def __init__(self, board: Board, stored: bytes, spend_write: Callable[[], bool], *, has_flight: bool) -> None:
        self._board = board
        self._spend_write = spend_write
        self._held = [
            held._replace(value=held.setting.unpack(stored[4 * at :])) if stored else held
            for at, held in enumerate(SETTINGS)
        ]
        self._held += FLIGHT_SETTINGS if has_flight else ()

    def encode(self) -> bytes:
        """The values for the configuration."""
        return b"".join(held.setting.pack(held.value) for held in self.table[: len(SETTINGS)])

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply's payload, or None if it is another command."""
        body = unmask(payload) or b""
        match command:
            case SettingCommand.SETTING:
                return encode_reply(self._read(body))
            case SettingCommand.SET_SETTING:
                return encode_reply(self._set(body, now))
        return None

    @property
    def table(self) -> list[HeldSetting]:
        self._held[_RADIUS] = self._held[_RADIUS]._replace(value=self._board.wp_radius_cm)
        return self._held

    def _all(self, status: ReplyStatus) -> TableReply:
        return TableReply(status, len(self._held), table_checksum(self.table))

    def _read(self, body: bytes) -> SettingsReply | TableReply:
        first, count = _READ.unpack(body) if len(body) == _READ.size else (0, 0)
        if not count:
            return SettingsReply(ReplyStatus.BAD_REQUEST, 0)
        if self._board.armed:
            return SettingsReply(ReplyStatus.ARMED, first)
        if first == WHOLE_TABLE:
            return self._all(ReplyStatus.OK)
        if first >= len(self._held):
            return SettingsReply(ReplyStatus.RANGE, first)
        found = self.table[first : first + count]
        while len(encode_reply(reply := SettingsReply(ReplyStatus.OK, first, found))) > SETTINGS_SIZE:
            found.pop()
        return reply

    def _set(self, body: bytes, now: float) -> SettingsReply | TableReply:
        if len(body) != _SET.size:
            return SettingsReply(ReplyStatus.BAD_REQUEST, 0)
        index, identity, bits = _SET.unpack(body)
        if self._board.armed or self._board.write_pending:
            return SettingsReply(ReplyStatus.ARMED if self._board.armed else ReplyStatus.BUSY, index)
        if index == WHOLE_TABLE:
            if identity:
                return SettingsReply(ReplyStatus.BAD_REQUEST, index)
            return self._save(int.from_bytes(bits, "little"), now)
        if index >= len(self._held):
            return SettingsReply(ReplyStatus.RANGE, index)
        held = self.table[index]
        if held.setting.identity != identity:
            return SettingsReply(ReplyStatus.CHECKSUM, index)
        value = held.setting.unpack(bits)
        is_whole = held.setting.pack(value) == bits  # an integer wider than its variable is out of range
        may_crash = held.setting.name in CRASHING and value != held.value
        is_dangerous = (index == _MOTORS_OFF and value > held.value) or may_crash
        is_float = held.setting.type is SettingType.FLOAT
        is_accepted = held.setting.minimum <= value <= held.setting.maximum and (is_float or value == value // 1)
        if not (is_accepted and is_whole) or is_dangerous:
            return SettingsReply(ReplyStatus.RANGE, index, [held])
        self.change(index, value)
        return SettingsReply(ReplyStatus.OK, index, [self._held[index]])

    def change(self, index: int, value: float) -> None:
        """Set a value in RAM, with its effect on others."""
        if value == self._held[index].value:
            return
        self._held[index] = self._held[index]._replace(value=value)
        if index == _RADIUS:
            self._board.wp_radius_cm = int(value)
        if index == _SENSOR:
            for trim in _TRIMS:
                self._held[trim] = self._held[trim]._replace(value=0.0)

    def _save(self, expected: int, now: float) -> TableReply:
        if table_checksum(self.table) != expected:
            return self._all(ReplyStatus.CHECKSUM)
        if not self._spend_write():
            return self._all(ReplyStatus.BUSY)
        self._board.schedule_write(now)
        return self._all(ReplyStatus.OK)
