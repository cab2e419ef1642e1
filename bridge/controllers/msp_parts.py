# SPDX-License-Identifier: GPL-3.0-or-later
"""PIDs, modes, rates and MISC as settings, for boards that do not list their settings themselves.

A part is always written whole: it is read again right before, so that only one value of it changes.
"""

from dataclasses import replace
from typing import NamedTuple

from bridge.fc.fc_settings import NO_ANSWER, NOT_TAKEN, FcSettings, SettingRefusal, TableReading, fixed
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, Pause, ask, ask_surely
from bridge.model.board_setting import BoardSetting, SettingTable, Value, ValueKind, table_of
from protocols.msp.command_line import is_clean
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, request
from protocols.msp.settings import RANGE_SIZE, SETTINGS, Field, Part, SettingNames, SettingsRequest, fields
from protocols.msp.telemetry import decode_box_names
from protocols.rights.effect import Effect
from protocols.rights.msp import msp_right

_ARM = "the arm switch is set with the board's own configurator, a wrong one could arm"
_PULSE = "disarmed motors get this pulse: set it with the board's own configurator"
_UNKNOWN = "this firmware's way to set it is not known"
_HAZARD = "the firmware could take bytes of this change for typed keys: try another value"
#: Permanent id of the box that arms.
_ARM_ID = 0


class _Place(NamedTuple):
    """A setting's handle."""

    part: SettingsRequest
    field: Field


class MspPartSettings(FcSettings):
    """Some parts of a board's settings; all that its firmware has, if none is named."""

    def __init__(self, board: FlightController, *parts: SettingsRequest) -> None:
        self._parts = parts or SETTINGS[board.firmware]
        self._firmware = board.firmware
        self._names = SettingNames(boxes=board.boxes)
        self._accepts_any_byte = board.profile.accepts_any_byte

    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        found: list[BoardSetting] = []
        for part in self._parts:
            if part.part is Part.PIDS and not self._names.pids:
                names = yield from self._payload(Msp.PIDNAMES)
                self._names = replace(self._names, pids=decode_box_names(names or b""))
            payload = yield from self._payload(part.command)
            if payload is None:
                return None
            # Without a payload the board does not have this part.
            found += self._shown(part, payload)
            yield Pause(reading.pace(2 * len(payload)))
        return table_of(*found)

    def change(
        self, table: SettingTable, setting: BoardSetting, value: Value
    ) -> Conversation[SettingTable | SettingRefusal]:
        part, field = setting.handle
        before = yield from self._payload(part.command)
        if before is None:
            return NO_ANSWER
        present = {each.name: each for each in self._shown(part, before)}
        if setting.name not in present or present[setting.name].fixed:
            return fixed(present.get(setting.name, replace(setting, fixed="the board's settings have changed")))
        after = field.put(before, int(value))
        if part.command == Msp.MODE_RANGES:
            number = field.at // RANGE_SIZE
            after = bytes((number,)) + after[number * RANGE_SIZE : (number + 1) * RANGE_SIZE]
            if after[1] == _ARM_ID and after[1:] != before[number * RANGE_SIZE : (number + 1) * RANGE_SIZE]:
                return fixed(replace(setting, fixed=_ARM))
        frame = request(part.setter, after)
        if not (self._accepts_any_byte or is_clean(frame)):
            return fixed(replace(setting, fixed=_HAZARD))
        right = msp_right(self._firmware, part.setter, after)
        if right.effect is not Effect.CHANGE:
            return fixed(replace(setting, fixed=_UNKNOWN))
        reply = yield from ask(frame, part.setter, right.reply)
        held = yield from self._payload(part.command)
        if reply is None or not held:
            return NO_ANSWER
        return NOT_TAKEN if reply.direction is Direction.ERROR else table.updated(*self._shown(part, held))

    def _payload(self, command: int) -> Conversation[bytes | None]:
        """The reply's payload, empty if the board does not know the command; None if it does not answer."""
        right = msp_right(self._firmware, command, b"")
        if right.effect is not Effect.READ:
            return b""
        reply = yield from ask_surely(request(command), command, right.reply)
        if reply is None:
            return None
        return reply.payload if reply.direction is Direction.REPLY else b""

    def _shown(self, part: SettingsRequest, payload: bytes) -> list[BoardSetting]:
        found = []
        for field in fields(part, payload, self._names):
            name = "".join(letter if letter.isalnum() else "_" for letter in field.name).upper()
            found.append(
                BoardSetting(
                    name,
                    ValueKind.INTEGER,
                    0,
                    (1 << 8 * field.size) - 1,
                    field.value(payload),
                    fixed=self._fixed(part, field, payload),
                    handle=_Place(part, field),
                )
            )
        return found

    def _fixed(self, part: SettingsRequest, field: Field, payload: bytes) -> str:
        if part.command == Msp.MODE_RANGES:
            first = field.at // RANGE_SIZE * RANGE_SIZE
            _, _, low, high = payload[first : first + RANGE_SIZE]
            return _ARM if payload[first] == _ARM_ID and low < high else ""
        if field.name == "BOX ARM":
            return _ARM
        return _PULSE if field.name == "min command" else ""
