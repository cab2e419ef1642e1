# SPDX-License-Identifier: GPL-3.0-or-later
"""One upload, from MISSION_COUNT to the final MISSION_ACK: its states, what ends them, and the one table of both."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from bridge.missions.list_check import ListCheck
from bridge.missions.mission_service import OCCUPIED
from bridge.model.refusal import Refusal
from bridge.model.verdict import Verdict
from bridge.vehicle.item_request import ItemRequest
from protocols.mission_item import MissionItem, MissionResult

#: Mission Planner's "Write Fast" has ended: for so long an item that the network delayed may still come, s.
_LAST_ITEMS_S = 0.3


class Event:
    """What takes an upload from one state to the next."""


class Turn(Event):
    """No other transfer runs any more."""


@dataclass(frozen=True, slots=True)
class Ready(Event):
    """The flight controller would take a list."""

    check: ListCheck


@dataclass(frozen=True, slots=True)
class Judged(Event):
    """The whole list is there, or enough of it to reject it."""

    items: tuple[MissionItem, ...]
    verdict: Verdict[Any]


class Delivered(Event):
    """The flight controller holds the list, or does not: either way that was verified."""


@dataclass(frozen=True, slots=True)
class Ended(Event):
    """Refused, cancelled or timed out."""

    refusal: Refusal


class State(ABC):
    """A state ends by itself at `deadline`, `seconds` after it began or went on, with `timeout` as the answer."""

    seconds: ClassVar[float]

    def __init__(self, now: float) -> None:
        self.deadline = now + self.seconds

    @property
    @abstractmethod
    def timeout(self) -> Refusal:
        """The answer to the ground station if nothing happens until the deadline."""

    def next_tick(self) -> float:
        """When there is something to do."""
        return self.deadline


class Waiting(State):
    """Another transfer runs. Mission Planner repeats its MISSION_COUNT for 2.8 s."""

    seconds = 2.5
    timeout = OCCUPIED


class Asking(State):
    """The flight controller is asked whether it would take a list."""

    seconds = 5.0
    timeout = Refusal(MissionResult.DENIED, "The flight controller does not answer: try again")


class Receiving(State):
    """Items come in, each judged as soon as all before it are there."""

    seconds = 5.0

    def __init__(self, now: float, count: int, check: ListCheck) -> None:
        super().__init__(now)
        self._count = count
        self._check = check
        self.items: dict[int, MissionItem] = {}
        self._judged = 0  # items 0.._judged-1 are there and judged
        self.request = ItemRequest()
        #: MISSION_COUNT came again, from a client that begins again or from the network: the next item tells.
        self.announced_again = False
        self._is_closed = False

    @property
    def timeout(self) -> Refusal:
        """Why the list is not written."""
        text = f"Upload silent for {self.seconds:.0f} s, old mission kept"
        if self._is_closed:
            missing = self._count - len(self.items)
            text = f"Mission NOT written: {missing} of {self._count} missing, use Write"
        return Refusal(MissionResult.OPERATION_CANCELLED, text)

    @property
    def is_closed(self) -> bool:
        """True once the ground station takes its list for written."""
        return self._is_closed

    @property
    def wanted(self) -> int:
        """The number of the lowest item that is missing."""
        return 0 if self.announced_again else self._judged

    def next_tick(self) -> float:
        """When the request is repeated, or the upload given up."""
        return min(self.deadline, self.request.due)

    def take(self, item: MissionItem, now: float) -> Judged | bool:
        """Keep an item: the end of the list, or whether the next one is to be requested."""
        if item.seq in self.items:
            return not self.request.is_copy(now)
        if item.seq == self._judged:
            self.request.answered(now)
        self.items[item.seq] = item
        self.deadline = max(self.deadline, now + (_LAST_ITEMS_S if self._is_closed else self.seconds))
        while self._judged in self.items:
            if self._check.take(self.items[self._judged]) is not None:
                return self._end()
            self._judged += 1
        return self._end() if self._judged == self._count else True

    def close(self, now: float) -> None:
        """The ground station says that it has ended: "Write Fast" does so whether or not every item has arrived."""
        if self.items:
            self._is_closed = True
            self.deadline = now + _LAST_ITEMS_S

    def _end(self) -> Judged:
        return Judged(tuple(self.items[seq] for seq in sorted(self.items)), self._check.finish())


class Delivering(State):
    """The list is stored, written and read back: 146 records take 25 s at 1200 baud."""

    seconds = 60.0
    timeout = Refusal(MissionResult.DENIED, "Still writing the mission: wait for the result")


#: State -> event -> next state, None at the end; any other event in a state is a bug. A clear asks for nothing first.
TRANSITIONS: Mapping[type[State], Mapping[type[Event], type[State] | None]] = {
    Waiting: {Turn: Asking, Judged: Delivering, Ended: None},
    Asking: {Ready: Receiving, Ended: None},
    Receiving: {Judged: Delivering, Ended: None},
    Delivering: {Delivered: None, Ended: None},
}
