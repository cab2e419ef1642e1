# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the flight controller: one, the table of all, what is remembered of it, and changes made elsewhere."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Protocol

from bridge.voice.sentences import settings_changed
from protocols.float32 import single
from protocols.param_file import is_setting_name

#: A text only where the setting is one.
Value = float | str
#: Of single precision.
_LARGEST = 3.4e38


class ValueKind(Enum):
    """The values that a setting may have."""

    INTEGER = "integer"
    #: Single precision.
    FLOAT = "float"
    TEXT = "text"


@dataclass(frozen=True, slots=True)
class BoardSetting:
    """A setting with the value that the board holds in RAM.

    name: as in the board's command line, or made from the MSP layout if that lacks the name. minimum, maximum: of a
    number; of a text its lengths. choices: names of the values from `minimum` on. fixed: the reason why it cannot be
    set over the air, or empty if it can. raised: the same for a higher value. handle: for FcSettings,
    to change it.
    """

    name: str
    kind: ValueKind
    minimum: float
    maximum: float
    value: Value
    unit: str = ""
    choices: tuple[str, ...] = ()
    fixed: str = ""
    raised: str = ""
    handle: Any = field(default=None, compare=False, repr=False)

    @property
    def range_text(self) -> str:
        """The accepted values, for a refusal."""
        if self.kind is ValueKind.TEXT:
            return f"{shown(self.minimum)} to {shown(self.maximum)} characters"
        unit = f" {self.unit}" if self.unit else ""
        return f"{shown(self.minimum)}..{shown(self.maximum)}{unit}"

    @property
    def wanted_text(self) -> str:
        """What a text must be, for a refusal."""
        return f"it is one of {', '.join(self.choices)}" if self.choices else f"it must be {self.range_text}"

    def parse(self, given: Value) -> Value | None:
        """The value of this kind that a file or a person means: a number, or the name of a choice, else None."""
        if self.kind is ValueKind.TEXT:
            return shown(given)
        if not isinstance(given, str):
            return given
        for number, choice in enumerate(self.choices):
            if choice.lower() == given.lower():
                return self.minimum + number
        try:
            return float(given)
        except ValueError:
            return None

    def accepts(self, value: Value) -> bool:
        """True if the value is of this kind and in range."""
        if isinstance(value, str):
            is_text = self.kind is ValueKind.TEXT and value.isascii() and value.isprintable()
            return is_text and self.minimum <= len(value) <= self.maximum
        is_number = self.kind is not ValueKind.TEXT and math.isfinite(value) and self.minimum <= value <= self.maximum
        return is_number and (self.kind is ValueKind.FLOAT or value == int(value))

    def holds(self, value: Value) -> bool:
        """True if the board would store it as the value it has."""
        if isinstance(value, str) or self.kind is not ValueKind.FLOAT:
            return value == self.value
        return single(value) == self.value


@dataclass(frozen=True, slots=True)
class SettingTable:
    """All settings of a board, in the board's order.

    is_complete: False if some could not be read. Their names are missing. is_remembered: True if only the values are
    known, from the last time.
    """

    settings: Mapping[str, BoardSetting] = field(default_factory=dict)
    is_complete: bool = True
    is_remembered: bool = False

    def __iter__(self) -> Iterator[BoardSetting]:
        return iter(self.settings.values())

    def __len__(self) -> int:
        return len(self.settings)

    def find(self, name: str) -> BoardSetting | None:
        """The setting of this name. Letters of the other case are accepted if they are unambiguous."""
        alike = [setting for setting in self if setting.name.lower() == name.lower()]
        return self.settings.get(name) or (alike[0] if len(alike) == 1 else None)

    def updated(self, *settings: BoardSetting) -> "SettingTable":
        return replace(self, settings={**self.settings, **{setting.name: setting for setting in settings}})


def table_of(*settings: BoardSetting, is_complete: bool = True) -> SettingTable:
    """Without those whose names would not fit into a ground station or file."""
    return SettingTable({each.name: each for each in settings if is_setting_name(each.name)}, is_complete)


def remembered_table(values: Mapping[str, Value]) -> SettingTable:
    kinds = {name: ValueKind.TEXT if isinstance(value, str) else ValueKind.FLOAT for name, value in values.items()}
    settings = (BoardSetting(name, kinds[name], -_LARGEST, _LARGEST, value) for name, value in values.items())
    return replace(table_of(*settings, is_complete=False), is_remembered=True)


def shown(value: Value) -> str:
    """A value as the board's command line would take it; floats with the digits that single precision has."""
    if isinstance(value, str):
        return value
    return str(int(value)) if abs(value) < 1e15 and value == int(value) else f"{value:.7g}"


@dataclass(frozen=True, slots=True)
class BoardId:
    """A flight controller. `kind`: firmware and version. `uid`: the chip's number, in hex, or "" if it has none."""

    kind: str
    uid: str = ""


@dataclass(frozen=True, slots=True)
class SettingsChange:
    """A change that did not come through the bridge. `at`: when it was noticed, monotonic s."""

    names: tuple[str, ...]
    at: float

    @property
    def text(self) -> str:
        """All names, for people."""
        return settings_changed(self.names).text


@dataclass(frozen=True, slots=True)
class SettingsState:
    """`seal`: a checksum of all settings as last read, 8 hexadecimal digits.

    `change`: the last made outside the bridge, while this board was connected, or None if there was none.
    """

    board: BoardId
    seal: str
    change: SettingsChange | None = None


class Occasion(Enum):
    """Why a backup was taken, as shown to the pilot."""

    CONNECTED = "connected"
    SAVED = "saved"
    CHANGED_ELSEWHERE = "changed elsewhere"


@dataclass(frozen=True, slots=True)
class TakenBackup:
    """The whole table of a board. Mostly equal to the one before."""

    board: BoardId
    values: Mapping[str, Value]
    occasion: Occasion


class SettingsMemory(Protocol):
    """Remembers the settings of each board, even after a restart of the daemon. A dict does so during this run."""

    def get(self, board: BoardId, default: Mapping[str, Value], /) -> Mapping[str, Value]:
        """Empty if none are known, or if they may have changed through the bridge since."""

    def __setitem__(self, board: BoardId, values: Mapping[str, Value], /) -> None: ...
