# SPDX-License-Identifier: GPL-3.0-or-later
"""One upload: its states from MISSION_COUNT to the final MISSION_ACK, their events and transitions."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, ClassVar

from bridge.gcs.station import Station
from bridge.missions.list_check import ListCheck
from bridge.missions.mission_service import OCCUPIED
from bridge.model.refusal import Refusal
from bridge.model.verdict import Verdict
from protocols.mission_item import MissionItem, MissionResult

#: After Mission Planner's "Write Fast" has ended, delayed items may still arrive for this long.
_LAST_ITEMS_S = 0.3
#: After a station's next MISSION_COUNT, items of its former list may still arrive for this long.
_FORMER_ITEMS_S = 2.0
#: The timeout of an item request: 1.5 times the round trip, within these limits.
_FIRST_TIMEOUT_S = 0.25
_MAX_TIMEOUT_S = 0.75
#: QGroundControl gives up 1.5 s after the last request that it received, so a lost one is repeated several times until
#: then. Later ones are rarer: Mission Planner gives up after ten that it received.
_OFTEN_S = 1.5
_SELDOM_S = 0.7
#: A message repeated within this time was duplicated by the network. Answering each copy would double every message
#: that follows, and MAVSDK gives up after five repeats; a ground station that missed our request repeats it later.
_REPEAT_AFTER_S = 0.1
#: An answer arrives within this time, or within two round trips. Mission Planner repeats an item after 0.45 s.
_ANSWER_S = 0.4
#: After a pause of this length, and its shortest time for an item, a ground station may have given up its list and
#: begun another: QGroundControl after 1.5 s, and then its user must act; MAVSDK after 2.5 s.
_ABANDONED_S = 2.0
#: QGroundControl reports a failed write 1.5 s after its last item, unless that is requested again; MAVSDK after 2.5 s.
#: Writing 120 records to an INAV takes 2.4 s. Twice in that time, in case one request is lost.
_NO_ANSWER_S = 0.6


class Event:
    """An event that changes an upload's state."""


class Announced(Event):
    """MISSION_COUNT or MISSION_CLEAR_ALL."""


class Turn(Event):
    """No other transfer delays this one."""


@dataclass(frozen=True, slots=True)
class Ready(Event):
    """The flight controller can take a list of `count` items; `is_next`: of a station that has just sent another."""

    count: int
    check: ListCheck
    is_next: bool


@dataclass(frozen=True, slots=True)
class Judged(Event):
    """The whole list has arrived, or enough of it to reject it."""

    items: tuple[MissionItem, ...]
    verdict: Verdict[Any]


class Delivered(Event):
    """The write has ended, with the verified result."""


@dataclass(frozen=True, slots=True)
class Ended(Event):
    """Refused, cancelled or timed out."""

    refusal: Refusal


class UploadState(ABC):
    """A state ends at `deadline`, `seconds` after its start or last progress; `timeout` is then the answer."""

    seconds: ClassVar[float]

    #: The ground station considers its list written.
    is_closed = False

    def __init__(self, event: Event, now: float) -> None:
        self.deadline = now + self.seconds

    @property
    def received(self) -> tuple[MissionItem, ...]:
        """The items so far, in the order of their numbers."""
        return ()

    @property
    def since(self) -> float:
        """The time of its start or last progress."""
        return self.deadline - self.seconds

    @property
    @abstractmethod
    def timeout(self) -> Refusal:
        """The answer to the ground station at the deadline."""

    def next_tick(self) -> float:
        return self.deadline

    def close(self, _now: float) -> None:
        """The ground station ends the upload: "Write Fast" does so even if items were lost."""
        self.is_closed = bool(self.received)


class Waiting(UploadState):
    """Another transfer runs. Mission Planner repeats its MISSION_COUNT for 2.8 s."""

    seconds = 2.5
    timeout = OCCUPIED


class Asking(UploadState):
    """The flight controller has been asked if it can take a list."""

    seconds = 5.0
    timeout = Refusal(MissionResult.DENIED, "The flight controller does not answer: try again")


@dataclass(slots=True)
class ItemRequest:
    """The pending item request. Its timeout follows the ground station's round trip time."""

    due: float = 0.0
    #: The item was requested more than once.
    is_repeated: bool = False
    _seq: int | None = None
    _first_at: float = 0.0
    _asked_at: float = 0.0
    #: When another item was requested last.
    _other_asked_at: float = -inf
    #: The first timeout of an item, and the present one.
    _timeout_s: float = _FIRST_TIMEOUT_S
    _present_s: float = _FIRST_TIMEOUT_S
    _round_trip_s: float | None = None
    #: The item that arrived last although requested twice, and the time from the first request.
    _late: tuple[int | None, float] = None, 0.0
    #: The number of answers still to come, by item.
    _unanswered: Counter[int] = field(default_factory=Counter)

    def asked(self, seq: int, now: float) -> None:
        self.is_repeated = seq == self._seq
        if not self.is_repeated:
            self._seq, self._first_at, self._present_s = seq, now, self._timeout_s
            self._other_asked_at = self._asked_at
        self._asked_at = now
        self._unanswered[seq] += 1
        self.due = now + self._present_s

    def lost(self, now: float) -> None:
        """No answer before `due`. The timeout grows if nothing was answered yet, or if many copies are lost."""
        if self._round_trip_s is None:
            self._present_s = min(self._present_s * 2, _SELDOM_S)
        else:
            often_s = max(self._round_trip_s / 2, _FIRST_TIMEOUT_S)
            self._present_s = often_s if now < self._first_at + _OFTEN_S else _SELDOM_S

    def explains_repeat(self, seq: int, now: float) -> bool:
        """True if a repeated item was requested as often, or is a copy made by the network: it needs no answer."""
        self._unanswered[seq] -= 1
        if self._unanswered[seq] == 0 and self._late[0] == seq:
            # Every request was answered, so the first answer belonged to the first one.
            self._set_round_trip(max(self._late[1], self._round_trip_s or 0.0))
        return self._unanswered[seq] >= 0 or now < self._asked_at + _REPEAT_AFTER_S

    def is_unrequested(self, seq: int, first_at: float, now: float) -> bool:
        """True if an item repeated since `first_at` is neither an answer to a request nor the network's copy."""
        self._unanswered[seq] -= 1
        asked_at = self._asked_at if seq == self._seq else self._other_asked_at
        round_trip_s = self._round_trip_s or 0.0
        is_late = now >= asked_at + max(_ANSWER_S, 2 * round_trip_s)
        return (is_late or self._unanswered[seq] < 0) and now >= first_at + _ANSWER_S

    def answered(self, seq: int, now: float) -> None:
        """Update the timeout when an item arrives for the first time."""
        self._unanswered[seq] -= 1
        if seq != self._seq:
            return
        known_s, elapsed_s = self._round_trip_s, now - self._first_at
        if self.is_repeated:
            # Either copy may have been lost.
            self._late = seq, elapsed_s
            self._set_round_trip(now - self._asked_at if known_s is None else known_s)
        else:
            self._set_round_trip(elapsed_s if known_s is None else known_s * 7 / 8 + elapsed_s / 8)

    def _set_round_trip(self, round_trip_s: float) -> None:
        self._round_trip_s = round_trip_s
        self._timeout_s = min(max(1.5 * round_trip_s, _FIRST_TIMEOUT_S), _MAX_TIMEOUT_S)


class Receiving(UploadState):
    """Items arrive; each is checked once all items before it are here."""

    seconds = 5.0

    def __init__(self, event: Ready, now: float) -> None:
        super().__init__(event, now)
        self._count = event.count
        self._check = event.check
        self.items: dict[int, MissionItem] = {}
        self._judged = 0  # items 0.._judged-1 have arrived and are checked
        self.request = ItemRequest()
        self._in_order_until = now + _FORMER_ITEMS_S if event.is_next else now
        self._progress_at = now
        self._shortest_pause_s = inf
        #: Perhaps the ground station has begun another list of this length. The next items show it.
        self._is_in_doubt = False
        self._was_in_doubt = False
        self._doubtful: MissionItem | None = None
        self._doubtful_at = now

    @property
    def timeout(self) -> Refusal:
        text = f"Upload silent for {self.seconds:.0f} s, old mission kept"
        if self.is_closed:
            missing = self._count - len(self.items)
            text = f"Mission NOT written: {missing} of {self._count} missing, use Write"
        return Refusal(MissionResult.OPERATION_CANCELLED, text)

    @property
    def received(self) -> tuple[MissionItem, ...]:
        return tuple(self.items[seq] for seq in sorted(self.items))

    @property
    def wanted(self) -> int:
        """The number of the lowest item that is missing."""
        return 0 if self._is_in_doubt else self._judged

    def next_tick(self) -> float:
        """The time to repeat the request, or to give up."""
        return min(self.deadline, self.request.due)

    def doubt(self) -> None:
        """After a second MISSION_COUNT or a pause: the client may have restarted."""
        self._is_in_doubt = bool(self.items)
        self._was_in_doubt |= self._is_in_doubt

    def is_of_another_list(self, item: MissionItem) -> bool:
        """True if the ground station has started again, perhaps with another list.

        Its MISSION_COUNT may be lost: a request for the former list's item also seems to answer it, and MAVProxy sends
        it only once. "Write Fast" does not wait for the request, so its first items may be lost.
        """
        held = self.items.get(item.seq, item)
        # As text, because NaN, "not given", differs from itself.
        return (self._was_in_doubt and item.seq == 0) or repr(held) != repr(item)

    def is_doubtful(self, item: MissionItem, now: float) -> bool:
        """True for a new item that may belong to another list.

        Soon after a former list these are all items but the requested one. After a second MISSION_COUNT or a long
        pause it is every item until it is repeated: MAVProxy and QGroundControl may have answered a request for the
        former list with an item of their new one, whose MISSION_COUNT is on its way or lost. Meanwhile item 0 is
        requested. Mission Planner does not send that, but repeats its item.
        """
        if item.seq not in self.items:
            if item.seq > self._judged and now < self._in_order_until:
                return True
            pause_s = now - self._progress_at
            if pause_s >= self._shortest_pause_s + _ABANDONED_S:
                self.doubt()
            if self._is_in_doubt:
                is_unrequested = self.request.is_unrequested(item.seq, self._doubtful_at, now)
                if repr(item) != repr(self._doubtful):
                    self._doubtful, self._doubtful_at = item, now
                    # Not at once: each request for another item costs Mission Planner one of its tries.
                    self.request.due = now + 1.25 * _ANSWER_S
                    return True
                if not is_unrequested:
                    return True
        self._is_in_doubt, self._doubtful = False, None
        return False

    def take(self, item: MissionItem, now: float) -> Judged | bool:
        """Keep an item; returns Judged at the end of the list, else True if the next item is to be requested."""
        if item.seq in self.items:
            return not self.request.explains_repeat(item.seq, now)
        self.request.answered(item.seq, now)
        self.items[item.seq] = item
        self._shortest_pause_s = min(self._shortest_pause_s, now - self._progress_at)
        self._progress_at = now
        self.deadline = max(self.deadline, now + (_LAST_ITEMS_S if self.is_closed else self.seconds))
        while self._judged in self.items:
            if self._check.take(self.items[self._judged]) is not None:
                return self._end()
            self._judged += 1
        return self._end() if self._judged == self._count else True

    def close(self, now: float) -> None:
        """Wait only for delayed items."""
        if self.items:
            self.is_closed = True
            self.deadline = now + _LAST_ITEMS_S

    def _end(self) -> Judged:
        return Judged(self.received, self._check.finish())


class Complete(UploadState):
    """The list has arrived, or it is a clear, and another one is being written."""

    seconds = 2.5
    timeout = OCCUPIED

    def __init__(self, event: Judged, now: float) -> None:
        super().__init__(event, now)
        self.judged = event

    @property
    def received(self) -> tuple[MissionItem, ...]:
        return self.judged.items


class Delivering(UploadState):
    """The list is stored, written and read back: 146 records take 25 s at 1200 baud."""

    seconds = 60.0
    timeout = Refusal(MissionResult.DENIED, "Still writing the mission: wait for the result")


@dataclass(slots=True, eq=False)
class Upload:
    """One ground station's upload of `count` items; a clear has 0."""

    station: Station
    count: int
    incident: str
    state: UploadState
    #: MAV_MISSION_TYPE of the final MISSION_ACK.
    mission_type: int
    #: When its ground station last sent a message of this upload.
    heard_at: float
    #: Its ground station has sent another list just before.
    is_next: bool = False
    #: Its ground station has announced another list, or begun to read, while this one was written.
    is_superseded: bool = False
    #: Its ground station has sent a MISSION_COUNT of 0.
    is_cancelled: bool = False
    #: When to request the last two items again, while the whole list waits for its write and result.
    reminder_at: float = inf

    def remind_later(self, now: float) -> None:
        """The ground station has sent its last item or repeated it, and waits for the final MISSION_ACK."""
        self.reminder_at = now + _NO_ANSWER_S if self.count and not self.is_superseded else inf

    def next_tick(self) -> float:
        return min(self.state.next_tick(), self.reminder_at)


#: State -> event -> next state, None at the end; any other event in a state is a bug. A clear asks for nothing first.
TRANSITIONS: Mapping[type[UploadState], Mapping[type[Event], type[UploadState] | None]] = {
    Waiting: {Turn: Asking, Judged: Complete, Ended: None},
    Asking: {Ready: Receiving, Ended: None},
    Receiving: {Judged: Complete, Ended: None},
    Complete: {Turn: Delivering, Ended: None},
    Delivering: {Delivered: None, Ended: None},
}
