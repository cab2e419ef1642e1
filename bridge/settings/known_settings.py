# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's settings as last read, and how reliable they are.

The settings of each board are remembered, so that a change without the bridge between two flights is noticed.
"""

from collections.abc import Mapping, Sequence
from enum import IntEnum
from zlib import crc32

from bridge.model.settings import (
    BoardId,
    BoardSetting,
    Occasion,
    SettingsChange,
    SettingsMemory,
    SettingsState,
    SettingTable,
    TakenBackup,
    Value,
    remembered_table,
)


class Freshness(IntEnum):
    """How reliably the table matches the board."""

    #: Not read from this board since it was found.
    UNREAD = 0
    #: Any setting may have changed through the bridge.
    DOUBTFUL = 1
    #: A change through the bridge was read back. It may have had an effect on other settings.
    CHANGED = 2
    CHECKED = 3


class KnownSettings:
    """The table as last read, the freshness, and the board that it belongs to."""

    def __init__(self, memory: SettingsMemory) -> None:
        self._memory = memory
        #: Kept while the board is armed or lost.
        self.table: SettingTable | None = None
        self.freshness = Freshness.UNREAD
        #: The board that was found, or None until it is identified.
        self.board: BoardId | None = None
        #: The settings that were changed here, and not saved since.
        self.unsaved: dict[str, Value] = {}
        #: True if the board's flash is known to hold the settings in RAM.
        self.is_saved = False
        #: None until the settings of a board were read. Those of a lost board stay.
        self.state: SettingsState | None = None
        #: Changes through the bridge may be among the differences that the next reading finds.
        self._is_ours = False
        self._occasion = Occasion.CONNECTED

    def found(self) -> None:
        """A board was found, perhaps the same again."""
        self.freshness, self.board = Freshness.UNREAD, None
        self._occasion = Occasion.CONNECTED

    def identified(self, board: BoardId) -> None:
        """Recall the table as last read, if the board is known by its chip's number: an INAV takes 20 s to read."""
        self.board = board
        if self._is_ours:
            self._memory[board] = {}
        values = self._memory.get(board, {})
        if board.uid and values and (self.state is None or self.state.board != board):
            self.table = remembered_table(values)

    def may_have_changed(self, freshness: Freshness = Freshness.DOUBTFUL) -> None:
        """The bridge, or a program through it, may have changed settings: the next differences are not reported."""
        self.freshness = min(self.freshness, freshness)
        self._is_ours, self.is_saved = True, False
        if self.board is not None:
            self._memory[self.board] = {}  # the daemon may end before the next reading

    def changed(self, settings: Sequence[BoardSetting]) -> None:
        """The settings read back after a change through the bridge."""
        self.may_have_changed(Freshness.CHANGED)
        self.table = (self.table or SettingTable()).updated(*settings)

    def saved(self) -> None:
        """The board has saved the settings. A firmware may correct some that contradict each other."""
        self.unsaved.clear()
        self._occasion = Occasion.SAVED
        self.may_have_changed()
        self.is_saved = True

    def read(self, table: SettingTable, now: float) -> tuple[SettingsChange | None, TakenBackup | None]:
        """All settings were read. The change without the bridge, and the table if it is worth a backup."""
        self.table, self.freshness, self._is_ours = table, Freshness.CHECKED, False
        if self.board is None or not table:
            return None, None
        values = {setting.name: setting.value for setting in table}
        remembered = self._memory.get(self.board, {})
        names = tuple(
            name
            for name, value in values.items()
            if repr(remembered.get(name, value)) != repr(value) and name not in self.unsaved
        )
        if values != remembered:
            self._memory[self.board] = values
        elsewhere = SettingsChange(names, now) if names else None
        is_same_board = self.state is not None and self.state.board == self.board
        last = self.state.change if self.state is not None and is_same_board else None
        seal = f"{crc32(repr(sorted(values.items())).encode()):08x}"
        self.state = SettingsState(self.board, seal, elsewhere or last)
        return elsewhere, self._backup(self.board, values) if table.is_complete else None

    def _backup(self, board: BoardId, values: Mapping[str, Value]) -> TakenBackup | None:
        """With changes that are not saved yet it is not a backup: a restart would lose them."""
        self.unsaved = {name: value for name, value in self.unsaved.items() if values.get(name) == value}
        if self.unsaved:
            return None
        backup = TakenBackup(board, values, self._occasion)
        self._occasion = Occasion.CHANGED_ELSEWHERE
        return backup
