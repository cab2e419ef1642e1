# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission progress from NAV_STATUS: the record that the craft flies to, and the last one reached."""

from dataclasses import dataclass
from enum import Enum

from bridge.model.verdict import SentSeqs
from protocols.mission_item import MissionItem
from protocols.msp.nav import FINISHED, LEGS, NavAction, NavMode, NavState, NavStatus

#: In these states the craft is at its record's place.
_THERE = frozenset((NavState.HOLD_TIMED, NavState.LAND_IN_PROGRESS, NavState.LANDED, NavState.HOVER_ABOVE_HOME))
_REACHED = LEGS | {NavAction.RTH}


class Progress(Enum):
    """MAVLink's MISSION_STATE."""

    UNKNOWN = 0
    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    COMPLETE = 5

    @property
    def text(self) -> str:
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True, slots=True)
class FlownMission:
    """The flight controller's list, home first, and the progress through it: the craft flies to item `seq`.

    By default the list is unknown.
    """

    items: tuple[MissionItem, ...] = ()
    seq: int = 0
    progress: Progress = Progress.UNKNOWN

    def counted(self, sent_seqs: SentSeqs) -> tuple[int, int]:
        """The current and the last item's number: as sent, or as read back if `sent_seqs` is empty."""
        last = max(len(self.items) - 1, 0)
        return (sent_seqs[self.seq] or 0, sent_seqs[last] or 0) if sent_seqs else (self.seq, last)


class MissionProgress:
    """Feed it every NAV_STATUS. Records count from 1; `number` is 0 while no mission is flown."""

    def __init__(self) -> None:
        self.number = 0
        self.progress = Progress.NOT_STARTED
        self._action = 0
        self._reached = 0

    def take(self, status: NavStatus) -> int | None:
        """Take one reply; returns the record reached since the last one. Of several only the last is known."""
        before, action = self.number, self._action
        # The return home at the end of a mission is flown in the mode RTH.
        goes_home = status.mode == NavMode.RTH and status.action == NavAction.RTH and before > 0
        if status.mode != NavMode.MISSION and not goes_home:
            self.number = self._action = self._reached = 0
            self.progress = Progress.NOT_STARTED
            return None
        self.number, self._action = status.number, status.action
        self.progress = Progress.COMPLETE if status.error == FINISHED else Progress.ACTIVE
        is_there = status.state in _THERE
        if goes_home and is_there:
            self.progress = Progress.COMPLETE
        if is_there or self.progress is Progress.COMPLETE:
            before, action = status.number, status.action
        elif before == status.number:
            return None
        if action not in _REACHED or before == self._reached:
            return None
        self._reached = before
        return before
