# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission progress: the record that the craft flies to, and the ones reached."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from protocols.mission_item import MissionItem
from protocols.msp.nav import FINISHED, LEGS, NavAction, NavMode, NavState, NavStatus
from reports.vehicle_groups import Progress
from reports.verdict import SentSeqs

#: In these states the craft is at its record's place.
_THERE = frozenset((NavState.HOLD_TIMED, NavState.LAND_IN_PROGRESS, NavState.LANDED, NavState.HOVER_ABOVE_HOME))
_REACHED = LEGS | {NavAction.RTH}


class Stage(IntEnum):
    """MAVLink's MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


@dataclass(frozen=True, slots=True)
class Way:
    """The way to the target: metres, degrees clockwise from north, metres up."""

    distance_m: float
    bearing_deg: float
    climb_m: float


@dataclass(frozen=True, slots=True)
class FlightReport:
    """A report of a board that counts the records it has reached (Harakiri).

    number: the record in flight, or at which the flight has stopped, from 1; 0: none. reached: the last one reached, in
    this flight or the one before. is_flown: the mission flies the craft. way, stage: None if not reported. why: the
    reason for a stop or a delay, for the pilot.
    """

    number: int
    reached: int
    progress: Progress
    is_flown: bool
    way: Way | None = None
    stage: Stage | None = None
    why: str = ""


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
    """Feed it every report. Records count from 1; `number` is 0 while no mission is flown."""

    def __init__(self) -> None:
        self.number = 0
        self.progress = Progress.NOT_STARTED
        #: The record that a ground station sets: the one that is left for it is not reached.
        self.set_to = 0
        self._action = 0
        self._reached: int | None = None

    def take(self, report: NavStatus | FlightReport) -> Sequence[int]:
        """Take one report; returns the records reached since the one before."""
        if isinstance(report, FlightReport):
            return self._take_flight(report)
        reached = self._take_status(report)
        return () if reached is None else (reached,)

    def _take_flight(self, report: FlightReport) -> Sequence[int]:
        number, reached = self.number, self._reached
        self.number, self.progress, self._reached = report.number, report.progress, report.reached
        if reached is None or not (number or report.number):
            return ()
        if report.reached < reached:  # another flight has begun
            reached = max(report.reached - 1, 0)
        return range(reached + 1, report.reached + 1)

    def _take_status(self, status: NavStatus) -> int | None:
        """If several records were reached since the last reply, only the last is known."""
        before, action = self.number, self._action
        if status.number == self.set_to > 0:
            before = self._reached = self.set_to = 0
        # The return home at the end of a mission is flown in the mode RTH.
        goes_home = status.mode == NavMode.RTH and status.action == NavAction.RTH and self.number > 0
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
