# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's settings: their seal, and changes made outside the bridge."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol
from zlib import crc32

from protocols.msp.settings import Part


@dataclass(frozen=True, slots=True)
class BoardId:
    """A flight controller. `kind`: its firmware and version. `uid`: its chip's number, in hex; "" if it has none."""

    kind: str
    uid: str = ""


@dataclass(frozen=True, slots=True)
class Seal:
    """The settings as last read: the bytes of each part that the board has."""

    parts: Mapping[Part, bytes]

    def __str__(self) -> str:
        """A checksum over all parts, 8 hexadecimal digits."""
        crc = 0
        for part in Part:
            crc = crc32(b"%d:" % len(payload) + payload if (payload := self.parts.get(part)) is not None else b"-", crc)
        return f"{crc:08x}"


@dataclass(frozen=True, slots=True)
class ChangedPart:
    """A part that changed; `names`: of its settings, as far as they are known."""

    part: Part
    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SettingsChange:
    """A change that did not come through the bridge. `at`: when it was noticed, monotonic s."""

    parts: Sequence[ChangedPart]
    at: float

    def text(self, most: int | None = None) -> str:
        """For the pilot: all names, or as many as fit into `most` characters."""
        longest = max((len(changed.names) for changed in self.parts), default=0)
        for names in range(longest, -1, -1):
            text = "Settings changed elsewhere: " + "; ".join(_shown(each, names) for each in self.parts)
            if most is None or len(text) <= most:
                break
        return text


@dataclass(frozen=True, slots=True)
class SettingsState:
    """`change`: the last one made outside the bridge, while this board was connected; None: there was none."""

    board: BoardId
    seal: Seal
    change: SettingsChange | None = None


class SealMemory(Protocol):
    """Remembers the seal of each board, even after a restart of the daemon."""

    def recall(self, board: BoardId) -> Seal | None: ...

    def keep(self, board: BoardId, seal: Seal) -> None: ...


class SealsOfThisRun:
    """Remembers seals while the program runs, for commands without a state directory, and tests."""

    def __init__(self) -> None:
        self._seals: dict[BoardId, Seal] = {}

    def recall(self, board: BoardId) -> Seal | None:
        return self._seals.get(board)

    def keep(self, board: BoardId, seal: Seal) -> None:
        self._seals[board] = seal


def _shown(changed: ChangedPart, most: int) -> str:
    names = list(changed.names[:most])
    if names and len(changed.names) > most:
        names.append(f"+{len(changed.names) - most}")
    return f"{changed.part.value} {', '.join(names)}".rstrip()
