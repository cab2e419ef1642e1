# SPDX-License-Identifier: GPL-3.0-or-later
"""The pending request for an item of an upload: when it is repeated, and which items answer it. Sans-IO."""

from collections import Counter
from dataclasses import dataclass, field
from math import inf

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
ANSWER_S = 0.4


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
        is_late = now >= asked_at + max(ANSWER_S, 2 * (self._round_trip_s or 0.0))
        return (is_late or self._unanswered[seq] < 0) and now >= first_at + ANSWER_S

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
