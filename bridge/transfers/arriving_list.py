# SPDX-License-Identifier: GPL-3.0-or-later
"""The items of an upload as they arrive. Two lists of one ground station are never mixed. Sans-IO."""

from collections import Counter
from dataclasses import dataclass, field
from enum import Enum, auto
from math import inf
from typing import Any

from bridge.missions.list_check import ListCheck
from bridge.model.verdict import Verdict
from protocols.mission_item import MissionItem

#: After a pause of this length, and its shortest time for an item, a ground station may have given up its list and
#: begun another: QGroundControl after 1.5 s, and then its user must act; MAVSDK after 2.5 s.
_ABANDONED_S = 2.0
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


class Reply(Enum):
    """The response to an item that does not complete the list."""

    NONE = auto()
    #: Request the next missing item.
    REQUEST = auto()
    #: The item belongs to another list: discard this one, and request item 0.
    START_AGAIN = auto()


@dataclass(frozen=True, slots=True)
class WholeList:
    """A list of which all items have arrived, or enough to reject it."""

    items: tuple[MissionItem, ...]
    verdict: Verdict[Any]


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
        self._unanswered[seq] = self._unanswered.get(seq, 0) + 1
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
        is_late = now >= asked_at + max(_ANSWER_S, 2 * (self._round_trip_s or 0.0))
        return (is_late or self._unanswered[seq] < 0) and now >= first_at + _ANSWER_S

    def answered(self, seq: int, now: float) -> None:
        """Update the timeout when an item arrives for the first time."""
        self._unanswered[seq] = self._unanswered.get(seq, 0) - 1
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


class _Trust(Enum):
    """The confidence that all items belong to one list."""

    CERTAIN = auto()
    #: Perhaps its station has begun another list of this length. The next items show it; item 0 is requested meanwhile.
    IN_DOUBT = auto()
    #: They seem to, but item 0, once requested, may still arrive and prove the opposite.
    RESTORED = auto()


class ArrivingList:
    """A list of `count` items; each is checked once all items before it are here.

    `former_until`: items of the station's former list may arrive until then, so they are accepted in order only.
    """

    def __init__(self, count: int, check: ListCheck, former_until: float, now: float) -> None:
        self._count = count
        self._check = check
        self._former_until = former_until
        self.items: dict[int, MissionItem] = {}
        self.request = ItemRequest()
        self._judged = 0  # items 0.._judged-1 have arrived and are checked
        #: When the last new item arrived.
        self.progress_at = now
        self._shortest_pause_s = inf
        self._trust = _Trust.CERTAIN
        #: A new item that arrived in doubt, and when it arrived first.
        self._suspect: tuple[MissionItem | None, float] = None, now

    @property
    def received(self) -> tuple[MissionItem, ...]:
        return tuple(map(self.items.__getitem__, sorted(self.items)))

    @property
    def missing(self) -> int:
        return self._count - len(self.items)

    @property
    def wanted(self) -> int:
        """The lowest missing item, or item 0 to learn if it is still the same list."""
        return 0 if self._trust is _Trust.IN_DOUBT else self._judged

    def doubt(self) -> None:
        """After a second MISSION_COUNT or a pause: the station may have begun another list."""
        if self.items:
            self._trust = _Trust.IN_DOUBT

    def take(self, item: MissionItem, now: float) -> WholeList | Reply:
        """Keep an item if it belongs to this list.

        An item that contradicts the list shows that its station has started again. The new MISSION_COUNT may be lost:
        a request for the former list's item also seems to answer it, and MAVProxy sends it only once. "Write Fast" does
        not wait for the request, so its first items may be lost.
        """
        seq, held = item.seq, self.items.get(item.seq)
        # As text, because NaN, "not given", differs from itself.
        if (self._trust is not _Trust.CERTAIN and seq == 0) or (held is not None and repr(held) != repr(item)):
            return Reply.START_AGAIN
        if held is None:
            if seq > self._judged and now < self._former_until:
                return Reply.NONE
            if now - self.progress_at >= self._shortest_pause_s + _ABANDONED_S:
                self.doubt()
            if self._trust is _Trust.IN_DOUBT and self._is_doubtful(item, now):
                return Reply.NONE
        if self._trust is _Trust.IN_DOUBT:
            self._trust, self._suspect = _Trust.RESTORED, (None, now)
        if held is not None:
            return Reply.NONE if self.request.explains_repeat(seq, now) else Reply.REQUEST
        self.request.answered(seq, now)
        self.items[seq] = item
        self._shortest_pause_s = min(self._shortest_pause_s, now - self.progress_at)
        self.progress_at = now
        while self._judged in self.items:
            if self._check.take(self.items[self._judged]) is not None:
                return WholeList(self.received, self._check.finish())
            self._judged += 1
        return WholeList(self.received, self._check.finish()) if self._judged == self._count else Reply.REQUEST

    def _is_doubtful(self, item: MissionItem, now: float) -> bool:
        """True until a new item is repeated.

        MAVProxy and QGroundControl may have answered a request for the former list with an item of their new one, whose
        MISSION_COUNT is on its way or lost; they also answer the request for item 0. Mission Planner does not send
        that, but repeats its item.
        """
        suspect, first_at = self._suspect
        is_unrequested = self.request.is_unrequested(item.seq, first_at, now)
        if repr(item) == repr(suspect):
            return not is_unrequested
        self._suspect = item, now
        # Not at once: each request for another item costs Mission Planner one of its tries.
        self.request.due = now + 1.25 * _ANSWER_S
        return True
