# SPDX-License-Identifier: GPL-3.0-or-later
"""The last final answer to each ground station, for repeated items. Sans-IO."""

from collections.abc import Callable
from dataclasses import dataclass

from bridge.gcs.station import Station
from protocols.mission_item import MissionResult

#: Mission Planner sends its last item for 5 s, its Cancel for 2.8 s.
_MEMORY_S = 10.0
_CANCEL_S = 3.0
#: More than there are ground stations; made-up ids replace the oldest entry.
_MOST = 64


@dataclass(frozen=True, slots=True)
class Answer:
    """A MISSION_ACK that ended an upload of `count` items; a repeated cancel is answered until `cancelled_until`."""

    ack: MissionResult
    count: int
    until: float
    cancelled_until: float

    @property
    def is_refusal(self) -> bool:
        return self.ack is not MissionResult.ACCEPTED


class RecentAnswers:
    """Remembers answers for 10 s. `has_moved`: True if the second is the first's new address (Stations.has_moved)."""

    def __init__(self, has_moved: Callable[[Station, Station, float], bool]) -> None:
        self._has_moved = has_moved
        self._answers: dict[Station, Answer] = {}  # oldest first

    def note(self, station: Station, ack: MissionResult, count: int, now: float, *, is_cancelled: bool = False) -> None:
        """A final answer was sent; `is_cancelled`: the station had cancelled the upload."""
        self._forget_old(now)
        self._answers.pop(station, None)
        if len(self._answers) >= _MOST:
            del self._answers[next(iter(self._answers))]
        self._answers[station] = Answer(ack, count, now + _MEMORY_S, now + _CANCEL_S if is_cancelled else now)

    def forget(self, station: Station) -> None:
        """The ground station has begun a new upload."""
        self._answers.pop(station, None)

    def was_said_to(self, station: Station, now: float) -> bool:
        """True if it was answered at this very address."""
        self._forget_old(now)
        return station in self._answers

    def to(self, station: Station, now: float) -> Answer | None:
        """The last answer to a ground station, at its current or previous address."""
        self._forget_old(now)
        if station in self._answers:
            return self._answers[station]
        return next((answer for known, answer in self._answers.items() if self._has_moved(known, station, now)), None)

    def is_known(self, station: Station, now: float) -> bool:
        """True if a station with these ids was answered, here or at an address that it may have left."""
        self._forget_old(now)
        return any((known.sysid, known.compid) == (station.sysid, station.compid) for known in self._answers)

    def _forget_old(self, now: float) -> None:
        while self._answers and now > self._answers[oldest := next(iter(self._answers))].until:
            del self._answers[oldest]
