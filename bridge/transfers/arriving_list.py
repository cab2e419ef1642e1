# SPDX-License-Identifier: GPL-3.0-or-later
"""The items of an upload as they arrive. Two lists of one ground station are never mixed. Sans-IO."""

from collections import Counter
from dataclasses import dataclass, field
from math import inf
from typing import Any

from bridge.gcs.ground_station import Sender
from bridge.missions.list_check import ListCheck
from bridge.voice.stations import Kind
from protocols.mission_item import MissionItem
from reports.verdict import Verdict

#: The timeout of an item request: 1.5 times the round trip, within these limits.
_FIRST_TIMEOUT_S = 0.25
_MAX_TIMEOUT_S = 0.75
#: QGroundControl gives up 1.5 s after the last request that it received, so a lost one is repeated several times until
#: then. Later repeats are rarer: Mission Planner gives up after ten that it received.
_OFTEN_S = 1.5
_SELDOM_S = 0.7
#: A sender of this many items that were not requested begins each list with item 0.
_UNREQUESTED = 3


@dataclass(frozen=True, slots=True)
class WholeList:
    """A list of which all items have arrived, or enough to reject it."""

    items: tuple[MissionItem, ...]
    verdict: Verdict[Any]


@dataclass(slots=True)
class ItemRequest:
    """The pending item request. The timeout follows the ground station's round trip time."""

    due: float = 0.0
    #: The item was requested more than once, and perhaps answered late.
    is_repeated: bool = False
    seq: int | None = None
    _first_at: float = 0.0
    _asked_at: float = 0.0
    _timeout_s: float = _FIRST_TIMEOUT_S
    _round_trip_s: float | None = None
    #: The item that arrived last although requested twice, and the time from the first request.
    _late: tuple[int | None, float] = None, 0.0
    #: The number of answers still to come, by item.
    _unanswered: Counter[int] = field(default_factory=Counter)

    def asked(self, seq: int, now: float) -> None:
        unanswered = self._unanswered.get(seq, 0)
        self.is_repeated = seq == self.seq or unanswered > 0
        if seq != self.seq:
            self.seq, self._first_at = seq, now
            self._timeout_s = min(max(1.5 * (self._round_trip_s or 0.0), _FIRST_TIMEOUT_S), _MAX_TIMEOUT_S)
        self._asked_at = now
        self._unanswered[seq] = unanswered + 1
        self.due = now + self._timeout_s

    def lost(self, now: float) -> None:
        """No answer before `due`. The timeout grows before the first answer, or if many copies are lost."""
        if self._round_trip_s is None:
            self._timeout_s = min(self._timeout_s * 2, _SELDOM_S)
        else:
            often_s = max(self._round_trip_s / 2, _FIRST_TIMEOUT_S)
            self._timeout_s = often_s if now < self._first_at + _OFTEN_S else _SELDOM_S

    def explains_repeat(self, seq: int) -> bool:
        """True if a repeated item was requested as often."""
        self._unanswered[seq] -= 1
        if self._unanswered[seq] == 0 and self._late[0] == seq:
            # Every request was answered, so the first answer belonged to the first.
            self._round_trip_s = max(self._late[1], self._round_trip_s or 0.0)
        return self._unanswered[seq] >= 0

    def answered(self, seq: int, now: float) -> bool:
        """Update the timeout when an item arrives for the first time since it was requested. False if it was not."""
        missing = self._unanswered[seq] = self._unanswered.get(seq, 0) - 1
        if seq != self.seq:
            return missing >= 0
        known_s, elapsed_s = self._round_trip_s, now - self._first_at
        if self.is_repeated:
            # Either copy may have been lost.
            self._late = seq, elapsed_s
            self._round_trip_s = now - self._asked_at if known_s is None else known_s
        else:
            self._round_trip_s = elapsed_s if known_s is None else known_s * 7 / 8 + elapsed_s / 8
        return True


class ArrivingList:
    """A list of `count` items. Each is checked once all items before it are here.

    If one of the sender's frames was lost since the first item, that may have been the MISSION_COUNT of another list:
    most stations answer the request for an item of the previous list with one of their new list. So all items are
    requested a second time before the last, and after it if a frame was lost just before it. Not from Mission Planner:
    such requests cost most of its ten tries, and it begins each list with item 0, as its unrequested items show.
    """

    def __init__(self, count: int, check: ListCheck, now: float) -> None:
        self._count = count
        self._check = check
        self.items: dict[int, MissionItem] = {}
        self.request = ItemRequest()
        self._judged = 0  # items 0.._judged-1 have arrived and are checked
        #: When the list last made progress.
        self.progress_at = now
        #: All items are of one list unless a frame after this one of their sender was lost.
        self._one_until = 0.0
        #: Items 0.._compared-1 were the same the second time, or None if they are not requested again.
        self._compared: int | None = None
        #: Items that arrived unrequested: in bursts ("Write Fast"), or instead of those requested again ("Write").
        self._unrequested = 0

    @property
    def received(self) -> tuple[MissionItem, ...]:
        return tuple(map(self.items.__getitem__, sorted(self.items)))

    @property
    def missing(self) -> int:
        return self._count - len(self.items)

    def ask_again(self, now: float) -> int:
        """The number of the item that is requested after a timeout.

        Not item 1: Mission Planner takes that request as the answer to the MISSION_COUNT of another list, and its
        repeat as that to the item 0, which may be lost.
        """
        wanted = self._judged if self._compared is None else self._compared
        if self._judged == 1:
            wanted = 0
        self.request.lost(now)
        self.request.asked(wanted, now)
        return wanted

    def moved(self) -> None:
        """The sender's address has changed: frames may have been lost."""
        if self._one_until < inf:
            self._one_until = -inf

    def take(self, item: MissionItem, sender: Sender, now: float) -> WholeList | int | None:
        """Keep an item of this list. The number of the item that is requested next, or None if none is."""
        seq, held = item.seq, self.items.get(item.seq)
        if not self.items:
            self._one_until = sender.frames
        if held is None or seq == self.request.seq:
            self._unrequested += not self.request.answered(seq, now)
            self.progress_at = now
        elif sender.is_copy or self.request.explains_repeat(seq):
            return None
        elif self._compared == 0:
            self._unrequested += 1
        if held is None:
            self.items[seq] = item
            while self._judged in self.items:
                if self._check.take(self.items[self._judged]) is not None:
                    return WholeList(self.received, self._check.finish())
                self._judged += 1
        elif seq == self._compared:
            self._compared += 1
        if self._compared is not None or (self._judged >= self._count - 1 and sender.last_lost > self._one_until):
            self._compare(sender)
        wanted = self._judged if self._compared is None else self._compared
        if seq == 1 and self.request.seq == 0 and self._compared is None and self._judged < self._count:
            # Item 0 was requested again too early. MAVSDK goes back to it, and then ignores requests beyond item 1.
            wanted = 1
        if wanted == self._count:
            return WholeList(tuple(map(self.items.__getitem__, range(wanted))), self._check.finish())
        self.request.asked(wanted, now)
        return wanted

    def _compare(self, sender: Sender) -> None:
        """Begin or end the second reading."""
        if sender.station.behaviour.kind is Kind.MISSION_PLANNER or self._unrequested >= _UNREQUESTED:
            self._compared, self._one_until = None, inf
        elif self._compared is None:
            self._compared = self._unrequested = 0
        elif self._compared == self._judged:
            self._compared, self._one_until = None, sender.frames
