# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between the settings and the flight controllers that have them.

Each kind of flight controller has its own way to read, change and save them: `bridge.controllers.harakiri.settings`,
`bridge.controllers.inav.settings`, and `bridge.controllers.msp_parts` for all others.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from math import isfinite

from bridge.line.conversation import Conversation, ask, ask_status
from bridge.model.settings import BoardSetting, SettingTable, Value, ValueKind, shown
from bridge.voice import sentences
from bridge.voice.happening import Happening
from protocols.msp.frame import Direction, request

_EEPROM_WRITE = 250
_ACK_SIZE = 2
#: Their timeouts together exceed the flash time of an STM32H743.
_ASKS_AFTER_SAVE = 12


class Cause(Enum):
    """The kind of reason for a setting that was not set, or settings that were not read or saved."""

    UNKNOWN_NAME = "unknown name"
    OUT_OF_RANGE = "out of range"
    FIXED = "cannot be set over the air"
    ARMED = "armed"
    OCCUPIED = "the line is needed for a mission"
    NO_LINK = "no flight controller"
    NO_ANSWER = "no answer"
    LIMIT = "too many writes"
    REFUSED = "refused by the flight controller"


@dataclass(frozen=True, slots=True)
class SettingRefusal:
    """The reason. After NO_ANSWER the board may or may not have acted."""

    cause: Cause
    why: Happening

    @property
    def text(self) -> str:
        """The whole reason, in one sentence for people."""
        return self.why.text


ARMED = SettingRefusal(Cause.ARMED, sentences.SETTINGS_ARMED())
NO_ANSWER = SettingRefusal(Cause.NO_ANSWER, sentences.SETTINGS_UNANSWERED())
WRITES_SPENT = SettingRefusal(Cause.LIMIT, sentences.BOARD_LIMITS_SAVES())
BUSY = SettingRefusal(Cause.OCCUPIED, sentences.SETTINGS_BUSY())
NOT_SAVED = SettingRefusal(Cause.REFUSED, sentences.SETTINGS_NOT_SAVED())
NOT_TAKEN = SettingRefusal(Cause.REFUSED, sentences.VALUE_NOT_TAKEN())


def out_of_range(setting: BoardSetting, value: Value) -> SettingRefusal:
    is_number = setting.kind is ValueKind.INTEGER and not isinstance(value, str) and isfinite(value)
    is_part = is_number and value != round(float(value))
    accepted = f"a whole number, {setting.range_text}" if is_part else setting.range_text
    return SettingRefusal(Cause.OUT_OF_RANGE, sentences.STAYS(setting.name, shown(setting.value), accepted))


def fixed(setting: BoardSetting) -> SettingRefusal:
    return SettingRefusal(Cause.FIXED, sentences.STAYS(setting.name, shown(setting.value), setting.fixed))


@dataclass(frozen=True, slots=True)
class TableReading:
    """How to read a table.

    pace: the pause in s after this many bytes, which leaves telemetry the share of the line. is_doubtful: True if
    settings may have changed without the bridge since the last reading.
    """

    pace: Callable[[int], float] = lambda _size: 0.0
    is_doubtful: bool = True


class FcSettings(ABC):
    """The settings of one flight controller. Conversations run while it is disarmed."""

    @abstractmethod
    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        """All settings, or None if the board does not answer. Other work may use the line at each Pause.

        previous: as last read, maybe from another board: it may be returned if it is still the board's.
        """

    @abstractmethod
    def write(self, setting: BoardSetting, value: Value) -> Conversation[SettingRefusal | None]:
        """Write one setting into the board's RAM. A value that the board does not take need not be refused here."""

    @abstractmethod
    def read_back(self, setting: BoardSetting) -> Conversation[Sequence[BoardSetting]]:
        """A setting that was written, as the board holds it, and maybe others, or empty if it does not answer."""

    def save(self) -> Conversation[SettingRefusal | None]:
        """Write the settings in RAM to the board's flash. Returns None if they are stored."""
        return write_eeprom()


def write_eeprom() -> Conversation[SettingRefusal | None]:
    """EEPROM_WRITE, sent once: some boards answer before they write, some after it, and a write takes up to 2.2 s."""
    reply = yield from ask(request(_EEPROM_WRITE), _EEPROM_WRITE, _ACK_SIZE, tries=1, exclusive=True)
    status = yield from ask_status(tries=_ASKS_AFTER_SAVE)
    if reply is None or status is None:
        return NO_ANSWER
    return NOT_SAVED if reply.direction is Direction.ERROR else None
