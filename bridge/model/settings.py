# SPDX-License-Identifier: GPL-3.0-or-later
"""What is remembered of a flight controller's settings, and changes made outside the bridge."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from bridge.model.board_setting import Value


@dataclass(frozen=True, slots=True)
class BoardId:
    """A flight controller. `kind`: its firmware and version. `uid`: its chip's number, in hex; "" if it has none."""

    kind: str
    uid: str = ""


@dataclass(frozen=True, slots=True)
class SettingsChange:
    """A change that did not come through the bridge. `at`: when it was noticed, monotonic s."""

    names: tuple[str, ...]
    at: float

    def text(self, most: int | None = None) -> str:
        """For the pilot: all names, or as many as fit into `most` characters."""
        for count in range(len(self.names), -1, -1):
            more = [f"+{len(self.names) - count}"] if count < len(self.names) else []
            text = "Settings changed elsewhere: " + ", ".join([*self.names[:count], *more])
            if most is None or len(text) <= most:
                break
        return text


@dataclass(frozen=True, slots=True)
class SettingsState:
    """`seal`: a checksum of all settings as last read, 8 hexadecimal digits.

    `change`: the last one made outside the bridge, while this board was connected; None: there was none.
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
    """The whole table of a board; mostly equal to the one before."""

    board: BoardId
    values: Mapping[str, Value]
    occasion: Occasion


class SettingsMemory(Protocol):
    """Remembers the settings of each board, even after a restart of the daemon."""

    def recall(self, board: BoardId) -> Mapping[str, Value]:
        """Empty if none are known, or if they may have changed through the bridge since."""

    def keep(self, board: BoardId, values: Mapping[str, Value]) -> None: ...


class MemoryOfThisRun:
    """Remembers settings while the program runs, for commands without a state directory, and tests."""

    def __init__(self) -> None:
        self._values: dict[BoardId, Mapping[str, Value]] = {}

    def recall(self, board: BoardId) -> Mapping[str, Value]:
        return self._values.get(board, {})

    def keep(self, board: BoardId, values: Mapping[str, Value]) -> None:
        self._values[board] = values
