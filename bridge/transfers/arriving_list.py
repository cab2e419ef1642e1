# SPDX-License-Identifier: GPL-3.0-or-later
"""The items of an upload as they arrive. Two lists of one ground station are never mixed. Sans-IO."""

from dataclasses import dataclass
from enum import Enum, auto
from math import inf
from typing import Any

from bridge.missions.list_check import ListCheck
from bridge.model.verdict import Verdict
from bridge.transfers.item_request import ANSWER_S, ItemRequest
from protocols.mission_item import MissionItem

#: After a pause of this length, and its shortest time for an item, a ground station may have given up its list and
#: begun another: QGroundControl after 1.5 s, and then its user must act; MAVSDK after 2.5 s.
_ABANDONED_S = 2.0


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
        self._progress_at = now
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
            if now - self._progress_at >= self._shortest_pause_s + _ABANDONED_S:
                self.doubt()
            if self._trust is _Trust.IN_DOUBT and self._is_doubtful(item, now):
                return Reply.NONE
        if self._trust is _Trust.IN_DOUBT:
            self._trust, self._suspect = _Trust.RESTORED, (None, now)
        if held is not None:
            return Reply.NONE if self.request.explains_repeat(seq, now) else Reply.REQUEST
        self.request.answered(seq, now)
        self.items[seq] = item
        self._shortest_pause_s = min(self._shortest_pause_s, now - self._progress_at)
        self._progress_at = now
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
        self.request.due = now + 1.25 * ANSWER_S
        return True
