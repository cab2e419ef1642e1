# SPDX-License-Identifier: GPL-3.0-or-later
"""The last final answer to each ground station, for the items that it goes on to repeat. Sans-IO."""

from collections.abc import Callable
from dataclasses import dataclass

from bridge.gcs.station import Station
from protocols.mission_item import MissionResult

#: Mission Planner sends its last item for 5 s.
_MEMORY_S = 10.0
#: Ground stations are few; who makes up numbers takes the oldest one's place.
_MOST = 64


@dataclass(frozen=True, slots=True)
class Answer:
    """A MISSION_ACK that ended an upload of `count` items."""

    ack: MissionResult
    count: int
    until: float

    @property
    def is_refusal(self) -> bool:
        """Whether the list was not taken."""
        return self.ack is not MissionResult.ACCEPTED


class RecentAnswers:
    """Remembers for a while. `moved_to`: where else a ground station is heard (Ground.moved_to)."""

    def __init__(self, moved_to: Callable[[Station, float], list[Station]]) -> None:
        self._moved_to = moved_to
        self._answers: dict[Station, Answer] = {}

    def note(self, station: Station, ack: MissionResult, count: int, now: float) -> None:
        """A ground station was told so."""
        self._forget_old(now)
        self._answers.pop(station, None)
        if len(self._answers) >= _MOST:
            del self._answers[next(iter(self._answers))]
        self._answers[station] = Answer(ack, count, now + _MEMORY_S)

    def forget(self, station: Station) -> None:
        """It has begun anew."""
        self._answers.pop(station, None)

    def was_said_to(self, station: Station, now: float) -> bool:
        """Tell whether it was answered at this very address."""
        self._forget_old(now)
        return station in self._answers

    def to(self, station: Station, now: float) -> Answer | None:
        """Return the last answer to a ground station, wherever it was then."""
        self._forget_old(now)
        if station in self._answers:
            return self._answers[station]
        return next((answer for who, answer in self._answers.items() if station in self._moved_to(who, now)), None)

    def is_known(self, station: Station, now: float) -> bool:
        """True if a station of these ids was answered, here or at an address that it may have left."""
        self._forget_old(now)
        return any((who.sysid, who.compid) == (station.sysid, station.compid) for who in self._answers)

    def _forget_old(self, now: float) -> None:
        self._answers = {who: answer for who, answer in self._answers.items() if now <= answer.until}
