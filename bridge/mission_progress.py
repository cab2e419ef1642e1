"""Where a craft is in its mission, as NAV_STATUS tells it: which record it flies to, and which it has reached."""

from enum import Enum

from protocols.msp.nav import FINISHED, LEGS, NavMode, NavState, NavStatus


class Progress(Enum):
    """MAVLink's MISSION_STATE, as far as it is told."""

    NOT_STARTED = 2
    ACTIVE = 3
    COMPLETE = 5


class MissionProgress:
    """Feed it every NAV_STATUS. Records count from 1; `number` is 0 while no mission is flown."""

    def __init__(self) -> None:
        self.number = 0
        self.progress = Progress.NOT_STARTED
        self._action = 0
        self._reached = 0

    def take(self, status: NavStatus) -> int | None:
        """Learn from one answer; return the record that was reached meanwhile. Of several only the last is known."""
        before, action = self.number, self._action
        if status.mode != NavMode.MISSION:
            self.number = self._action = self._reached = 0
            self.progress = Progress.NOT_STARTED
            return None
        self.number, self._action = status.number, status.action
        self.progress = Progress.COMPLETE if status.error == FINISHED else Progress.ACTIVE
        is_there = status.state in (NavState.HOLD_TIMED, NavState.LAND_IN_PROGRESS, NavState.LANDED)
        if is_there or self.progress is Progress.COMPLETE:
            before, action = status.number, status.action
        elif before == status.number:
            return None
        if action not in LEGS or before == self._reached:
            return None
        self._reached = before
        return before
