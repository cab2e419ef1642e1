# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the seals of flight controllers' settings in the state directory."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from bridge.model.settings import BoardId, Seal
from protocols.msp.settings import Part
from service.machine.state_file import StateFile

SEALS_FILE = "seals.json"
#: Boards; the one sealed least recently is forgotten first.
_MOST = 32


class SealFile:
    """A SealMemory. A board without a unique number is identified by its port. Without a `folder` nothing is stored."""

    def __init__(self, folder: Path | None, port: Callable[[], str]) -> None:
        self._port = port
        self._file = StateFile(folder, SEALS_FILE, "earlier changes of settings go unseen")
        self._seals: dict[str, Seal] = self._file.load(_read) or {}
        self.close = self._file.close

    def recall(self, board: BoardId) -> Seal | None:
        return self._seals.get(self._key(board))

    def keep(self, board: BoardId, seal: Seal) -> None:
        self._seals.pop(self._key(board), None)
        self._seals[self._key(board)] = seal
        while len(self._seals) > _MOST:
            del self._seals[next(iter(self._seals))]
        self._file.save({key: _plain(seal) for key, seal in self._seals.items()})

    def _key(self, board: BoardId) -> str:
        return f"{board.kind}, {board.uid or self._port()}"


def _plain(seal: Seal) -> dict[str, str]:
    return {part.value: payload.hex() for part, payload in seal.parts.items()}


def _read(kept: Any) -> dict[str, Seal]:
    return {
        str(board): Seal({Part(part): bytes.fromhex(payload) for part, payload in parts.items()})
        for board, parts in kept.items()
    }
