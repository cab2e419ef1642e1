# SPDX-License-Identifier: GPL-3.0-or-later
"""Clients that wait for the settings: for the whole table until their deadline, or for their changes, in order."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from bridge.fc.fc_settings import SettingRefusal
from bridge.model.board_setting import BoardSetting, SettingTable, Value

#: Changes that wait: of one client, which repeats them, and of all.
_MOST_OF_ONE, _MOST_WAITING = 8, 64

OnTable = Callable[[SettingTable | SettingRefusal, float], None]
#: Called with the setting as read back after a change, or with the reason why it has not this value.
OnChanged = Callable[[BoardSetting | SettingRefusal, float], None]


@dataclass(frozen=True, slots=True)
class Change:
    """A client's request. Without its callback it equals a repetition of it."""

    name: str
    value: Value
    client: str
    on_done: OnChanged = field(compare=False)


class Changes(deque[Change]):
    """The changes that wait, bounded for each client and for all."""

    def has_room_for(self, change: Change) -> bool:
        of_client = sum(each.client == change.client for each in self)
        return len(self) < _MOST_WAITING and of_client < _MOST_OF_ONE


class TableClients:
    """Those that wait for the table."""

    def __init__(self) -> None:
        self._waiting: list[tuple[float, OnTable]] = []

    def add(self, until: float, on_done: OnTable) -> None:
        self._waiting.append((until, on_done))

    def answer(self, answer: SettingTable | SettingRefusal, now: float, *, if_late: bool = False) -> None:
        """Answer all of them, or those whose deadline has passed."""
        waiting, self._waiting = self._waiting, []
        for until, on_done in waiting:
            if if_late and now < until:
                self._waiting.append((until, on_done))
            else:
                on_done(answer, now)
