# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes a backup of the settings when a board is met and when its saved settings have changed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from bridge.model.board_setting import SettingTable, Value
from bridge.model.settings import BoardId


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


OnBackup = Callable[[TakenBackup], None]


class BackupTaker:
    """Follows the readings of one board after another. `on_backup` gets each backup."""

    def __init__(self, on_backup: OnBackup) -> None:
        self._on_backup = on_backup
        self._board: BoardId | None = None
        self._occasion = Occasion.CONNECTED
        #: Read before the board's identity was known.
        self._waiting: SettingTable | None = None

    def found(self) -> None:
        """Another board, or the same again."""
        self._board, self._waiting, self._occasion = None, None, Occasion.CONNECTED

    def identified(self, board: BoardId) -> None:
        self._board = board
        if self._waiting is not None:
            self._take(self._waiting)

    def saved(self) -> None:
        """The settings were saved; they are read again after it."""
        self._occasion = Occasion.SAVED

    def read(self, table: SettingTable, unsaved: Mapping[str, Value]) -> None:
        """All settings were read. With changes that are not saved yet it is no backup: a restart would lose them."""
        held = (table.settings.get(name) for name in unsaved)
        if not table.is_complete or any(each is not None and each.value == unsaved[each.name] for each in held):
            return
        self._take(table)

    def _take(self, table: SettingTable) -> None:
        if self._board is None:
            self._waiting = table
            return
        values = {setting.name: setting.value for setting in table}
        self._on_backup(TakenBackup(self._board, values, self._occasion))
        self._occasion, self._waiting = Occasion.CHANGED_ELSEWHERE, None
