# SPDX-License-Identifier: GPL-3.0-or-later
"""PIDs, modes, rates and MISC as settings, for boards that do not list their settings themselves.

A part is always written whole: it is read again right before, so that only one value of it changes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from bridge.fc.fc_settings import NO_ANSWER, NOT_TAKEN, Cause, FcSettings, SettingRefusal, TableReading, fixed
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, Pause, ask, ask_surely
from bridge.model.settings import BoardSetting, SettingTable, Value, ValueKind, table_of
from bridge.voice import sentences
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, is_clean, request
from protocols.msp.mode_ranges import range_writes, ranges_text
from protocols.msp.settings import SETTINGS, Field, Part, SettingsRequest, fields
from protocols.msp.telemetry import decode_box_names
from protocols.rights import Effect
from protocols.rights.msp import msp_right

_ARM = "set the arm switch with the board's own configurator: a wrong range could arm the craft"
_PULSE = "disarmed motors get this pulse: set it with the board's own configurator"
_UNKNOWN = "naze-bridge does not know how this firmware sets it"
_HAZARD = "the firmware could mistake bytes of this change for typed keys: try another value"
_FIXED = {"BOX ARM": _ARM, "min command": _PULSE}
#: Permanent id of the box that arms.
_ARM_ID = 0
#: A mode's ranges, as a text.
_LONGEST_RANGES = 80


class _Place(NamedTuple):
    """A setting's handle. place: the field, or the mode's permanent id."""

    part: SettingsRequest
    place: Field | int


class MspPartSettings(FcSettings):
    """Some parts of a board's settings. All that the firmware has, if none is named."""

    def __init__(self, board: FlightController, *parts: SettingsRequest) -> None:
        self._parts = parts or SETTINGS[board.firmware]
        self._firmware = board.firmware
        self._boxes = board.boxes
        self._pids: tuple[str, ...] = ()
        #: Names of modes, by permanent id.
        self._modes: Mapping[int, str] = {}
        self._accepts_any_byte = board.profile.accepts_any_byte
        #: The last payloads, by command, or empty for a command that the board does not know.
        self._held: dict[int, bytes] = {}

    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        found: list[BoardSetting] = []
        for part in self._parts:
            if part.part is Part.PIDS and not self._pids:
                self._pids = decode_box_names((yield from self.payload(Msp.PIDNAMES)) or b"")
            elif part.part is Part.RANGES and not self._modes:
                ids = yield from self.payload(Msp.BOXIDS)
                names = decode_box_names((yield from self.payload(Msp.BOXNAMES)) or b"")
                # With many modes the names are cut.
                self._modes = dict(zip(ids or b"", [*names, *map(str, (ids or b"")[len(names) :])], strict=False))
            payload = yield from self.payload(part.command)
            if payload is None:
                return None
            # Without a payload the board does not have this part.
            found += self._shown(part, payload)
            yield Pause(reading.pace(2 * len(payload)))
        return table_of(*found)

    def write(self, setting: BoardSetting, value: Value) -> Conversation[SettingRefusal | None]:
        part, place = setting.handle
        before = yield from self.payload(part.command)
        if before is None:
            return NO_ANSWER
        present = {each.name: each for each in self._shown(part, before)}.get(setting.name)
        if present is None or present.fixed:
            return fixed(present or replace(setting, fixed="the board's settings have changed"))
        try:
            payloads = _payloads(before, place, value)
        except ValueError as error:
            return SettingRefusal(Cause.OUT_OF_RANGE, sentences.WRONG_FORM(setting.name, str(error)))
        if payloads is None:
            return fixed(replace(setting, fixed="the board has no free range"))
        for payload in payloads:
            frame, right = request(part.setter, payload), msp_right(self._firmware, part.setter, payload)
            if not (self._accepts_any_byte or is_clean(frame)):
                return fixed(replace(setting, fixed=_HAZARD))
            if right.effect is not Effect.CHANGE:
                return fixed(replace(setting, fixed=_UNKNOWN))
            reply = yield from ask(frame, part.setter, right.reply)
            if reply is None:
                return NO_ANSWER
            if reply.direction is Direction.ERROR:
                return NOT_TAKEN
        return None

    def read_back(self, setting: BoardSetting) -> Conversation[Sequence[BoardSetting]]:
        part, _ = setting.handle
        return self._shown(part, (yield from self.payload(part.command)) or b"")

    def payload(self, command: int) -> Conversation[bytes | None]:
        """The reply's payload, empty if the board does not know the command, or None if it does not answer."""
        right = msp_right(self._firmware, command, b"")
        held = self._held.get(command)
        if right.effect is not Effect.READ or held == b"":
            return b""
        # A payload as heard before was not damaged.
        reply = yield from ask(request(command), command, right.reply)
        if reply is not None and reply.payload != held:
            reply = yield from ask_surely(request(command), command, right.reply)
        if reply is None:
            return None
        self._held[command] = reply.payload if reply.direction is Direction.REPLY else b""
        return self._held[command]

    def _shown(self, part: SettingsRequest, payload: bytes) -> list[BoardSetting]:
        if part.part is Part.RANGES:
            return [
                BoardSetting(
                    _name(f"mode {name}"),
                    ValueKind.TEXT,
                    0,
                    _LONGEST_RANGES,
                    ranges_text(payload, number),
                    fixed=_ARM if number == _ARM_ID else "",
                    handle=_Place(part, number),
                )
                for number, name in (self._modes.items() if payload else ())
            ]
        return [
            BoardSetting(
                _name(field.name),
                ValueKind.INTEGER,
                0,
                (1 << 8 * field.size) - 1,
                field.value(payload),
                fixed=_FIXED.get(field.name, ""),
                handle=_Place(part, field),
            )
            for field in fields(part, payload, self._pids, self._boxes)
        ]


def _name(words: str) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in words).upper()


def _payloads(before: bytes, place: Field | int, value: Value) -> list[bytes] | None:
    """The payloads that set a value, or None without room for it. ValueError: the form of a mode's ranges."""
    if isinstance(place, Field):
        return [place.put(before, int(value))]
    return range_writes(before, place, str(value))
