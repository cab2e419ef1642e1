# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the last settings of flight controllers in the state directory."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bridge.model.settings import BoardId, Value
from service.machine.state_file import StateFile

SETTINGS_FILE = "last-settings.json"
#: Boards. The one read least recently is forgotten first. An INAV's settings are 25 kB.
_MOST = 16


class LastSettings:
    """A SettingsMemory. A board without a unique number is identified by the port.

    Without a `folder` it does not store anything.
    """

    def __init__(self, folder: Path | None, port: Callable[[], str]) -> None:
        self._port = port
        self._file = StateFile(folder, SETTINGS_FILE, "earlier changes of settings go unseen")
        self._boards: dict[str, Mapping[str, Value]] = self._file.load(_read) or {}
        self.close = self._file.close

    def get(self, board: BoardId, default: Mapping[str, Value], /) -> Mapping[str, Value]:
        return self._boards.get(self._key(board), default)

    def __setitem__(self, board: BoardId, values: Mapping[str, Value], /) -> None:
        key = self._key(board)
        is_known = self._boards.pop(key, None) == values
        self._boards[key] = values
        if is_known:
            return
        while len(self._boards) > _MOST:
            del self._boards[next(iter(self._boards))]
        self._file.save(self._boards)

    def _key(self, board: BoardId) -> str:
        return f"{board.kind}, {board.uid or self._port()}"


def _read(kept: Any) -> dict[str, Mapping[str, Value]]:
    return {
        str(board): {str(name): value for name, value in values.items() if isinstance(value, int | float | str)}
        for board, values in kept.items()
    }
