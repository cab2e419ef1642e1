# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions as plain data: refusals, stored records, transfers, and the progress of a flight."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Any

from bridge.voice import sentences
from bridge.voice.happening import Happening
from protocols.mission_item import ListIdentity, MissionItem, MissionResult
from protocols.msp.nav import FINISHED, LEGS, NavAction, NavMode, NavState, NavStatus
from reports.vehicle_groups import Progress
from reports.verdict import SentSeqs, Verdict


@dataclass(frozen=True, slots=True)
class Refusal:
    """The reply to a ground station: the MISSION_ACK code, and the reason as a STATUSTEXT."""

    ack: MissionResult
    why: Happening

    @property
    def text(self) -> str:
        """The whole reason."""
        return self.why.text


ARMED = Refusal(MissionResult.DENIED, sentences.ARMED())


class Outcome(Enum):
    """The outcome of a mission, as stored."""

    PENDING = "PENDING"
    VERIFIED = "VERIFIED"  # the flight controller holds it, checksum read back
    REJECTED = "REJECTED"  # by the rules. The flight controller was not touched
    CANCELLED = "CANCELLED"  # by the ground station, or by the timeout
    FAILED = "FAILED"  # the flight controller refused it or was not reachable


@dataclass(frozen=True, slots=True)
class ArrivedMission:
    """A mission as received: the source as text, the items as sent, and the verdict.

    `sender`: Sender.identity of the ground station; empty for other sources. `is_home_meant`: True if item 0 is surely
    home, whatever its frame, asked at the end.
    """

    source: str
    items: tuple[MissionItem, ...]
    verdict: Verdict[Any]
    sender: str = ""
    is_home_meant: Callable[[], bool] = lambda: False


@dataclass(frozen=True, slots=True)
class RecalledMission:
    """The store's facts about a list that was verified before.

    `sent_as`: the commands that ambiguous records were sent with, by record number. `sent_seqs`: of
    each ground station that counts by them, by Sender.identity.
    """

    sent_as: Mapping[int, int] = field(default_factory=dict)
    sent_seqs: Mapping[str, SentSeqs] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PendingMission:
    """A mission that the flight controller may or may not have.

    `number`: in the store, None if not stored. `identity`: of the list to look for, None if it was rejected.
    `before`: of the previous list, None if unknown.
    """

    number: int | None
    identity: ListIdentity | None
    before: ListIdentity | None = None


@dataclass(slots=True)
class FinalAck:
    """The MISSION_ACK that ended an upload of `count` items. It answers a Cancel until `cancelled_until`."""

    ack: MissionResult
    count: int
    sent_at: float
    cancelled_until: float
    #: When to send the ack again.
    again: Sequence[float] = ()

    @property
    def is_refusal(self) -> bool:
        return self.ack is not MissionResult.ACCEPTED


@dataclass(slots=True)
class Download:
    """The list as of the start of a download, from the flight controller's `fc_store`."""

    items: tuple[MissionItem, ...]
    until: float
    fc_store: object


@dataclass(slots=True)
class TransferMemory:
    """One station's running download, and the answer to the last upload, of one mission type.

    has_asked: for a list that could not be read, as programs do at each connection.
    """

    download: Download | None = None
    has_asked: bool = False
    final_ack: FinalAck | None = None


#: In these states the craft is at the record's place.
_THERE = frozenset((NavState.HOLD_TIMED, NavState.LAND_IN_PROGRESS, NavState.LANDED, NavState.HOVER_ABOVE_HOME))
_REACHED = LEGS | {NavAction.RTH}


class Stage(IntEnum):
    """MAVLink's MAV_LANDED_STATE."""

    ON_GROUND = 1
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

    number: the record in flight, or at which the flight has stopped, from 1; 0: none. reached: the last reached, in
    this flight or the one before. is_flown: the mission flies the craft. way, stage: None if not reported. why: the
    reason for a stop or a delay, for the pilot. summary: see FlightProgress, for the log.
    """

    number: int
    reached: int
    progress: Progress
    is_flown: bool
    way: Way | None = None
    stage: Stage | None = None
    why: Happening | None = None
    summary: int = 0


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
    """Feed it every report. Records count from 1. `number` is 0 unless a mission is flown."""

    def __init__(self) -> None:
        self.number = 0
        self.progress = Progress.NOT_STARTED
        #: The record that a ground station sets: the record that is left for it is not reached.
        self.set_to = 0
        self._action = 0
        self._reached: int | None = None

    def take(self, report: NavStatus | FlightReport) -> Sequence[int]:
        """Take one report. Returns the records reached since the one before."""
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
