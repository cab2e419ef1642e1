# SPDX-License-Identifier: GPL-3.0-or-later
"""A board of which some replies or messages never arrive, as a `peer` of the world."""

from random import Random
from typing import Any

#: Replies and errors.
_MSP, _MSP_V2, _MAVLINK_1 = (b"$M>", b"$M!"), (b"$X>", b"$X!"), 0xFE


class MutedBoard:
    """Any simulated board. `muted`: MSP commands and MAVLink message ids that are withheld from now on.

    `lost_rate`: the part of all others that is withheld, too.
    """

    def __init__(self, board: Any) -> None:
        self._board = board
        self._unread = bytearray()
        self.muted: frozenset[int] = frozenset()
        self.lost_rate = 0.0
        self._dice = Random(1)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._board, name)

    def advance(self, now: float) -> bytes:
        """Return the bytes for the bridge, in whole frames."""
        self._unread += self._board.advance(now)
        passed = bytearray()
        while (found := self._first_frame()) is not None:
            size, number = found
            if number not in self.muted and self._dice.random() >= self.lost_rate:
                passed += self._unread[:size]
            del self._unread[:size]
        return bytes(passed)

    def _first_frame(self) -> tuple[int, int | None] | None:
        """Its size and its command or message id; None until it is complete. Other bytes pass singly."""
        head = self._unread
        if head.startswith(_MSP_V2):
            size, number = (9 + int.from_bytes(head[6:8], "little"), int.from_bytes(head[4:6], "little"))
            return (size, number) if len(head) >= max(size, 9) else None
        if head.startswith(_MSP):
            return (6 + head[3], head[4]) if len(head) >= 6 and len(head) >= 6 + head[3] else None
        if head and head[0] == _MAVLINK_1:
            return (8 + head[1], head[5]) if len(head) >= 8 and len(head) >= 8 + head[1] else None
        if head and not any(begin.startswith(head) for begin in (*_MSP, *_MSP_V2)):
            return 1, None
        return None
