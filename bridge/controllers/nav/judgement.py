# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects of the board's own settings on a list that no single record shows."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from bridge.model.ground_track import Place
from protocols.msp.nav import NavRecord
from reports.finding import News


class Judgement(NamedTuple):
    """place: of the record; None: of the list. field: of its item. news: None if the list is rejected for it."""

    place: int | None
    field: str
    why: str
    news: News | None = News.WARNING


@dataclass(frozen=True, slots=True)
class Departure:
    """places: where the craft may be armed, as far as known: the list's home, and its own place.

    altitude_m: of the list's home above sea level; None if not given.
    """

    places: Sequence[Place] = ()
    altitude_m: float | None = None


class BoardLimits(Protocol):
    """The settings of one board that decide about its missions."""

    def judge(self, records: Sequence[NavRecord], departure: Departure) -> Iterable[Judgement]:
        """Whether, and how differently, the board flies these records."""
