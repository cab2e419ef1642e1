# SPDX-License-Identifier: GPL-3.0-or-later
"""The way of a list as its board flies it: from the craft over the kept items, with jumps and the return.

Each board's rules build it once (bridge.controllers.harakiri.check, bridge.controllers.nav.flown_path), and every
limit is judged on it.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from bridge.model.ground_track import Place, distance_m
from reports.finding import News
from reports.verdict import FlownLeg

#: Limits of our own, for boards that have none.
PLAIN_LEG_M, PLAIN_AWAY_M, PLAIN_HEIGHT_M = 2000, 5000, 120
#: The same in latitude; longitude is shorter.
_PLAIN_LEG_E7 = 179_000


class Point(NamedTuple):
    """A Place: degrees * 1e7."""

    lat_e7: int
    lon_e7: int


class Judgement(NamedTuple):
    """place: of the record; None: of the list. field: of the item. news: None if the list is rejected for it."""

    place: int | None
    field: str
    why: str
    news: News | None = News.DANGER


class Departure:
    """Where the flight begins, `place`: that of the craft if known, else the home of the list.

    A craft that is kilometres away from `first`, the first place of the list, is taken to be carried to the list's home
    if that is nearer. altitude_m: of the list's home above sea level, or None if not given.
    """

    def __init__(
        self,
        craft: Place | None = None,
        home: Place | None = None,
        altitude_m: float | None = None,
        first: Place | None = None,
    ) -> None:
        self.home, self.altitude_m = home, altitude_m
        self.carried_m = 0.0
        if craft is not None and home is not None and first is not None:
            # Without arithmetic for most.
            is_near = (
                abs(craft.lat_e7 - first.lat_e7) < _PLAIN_LEG_E7 and abs(craft.lon_e7 - first.lon_e7) < _PLAIN_LEG_E7
            )
            metres = 0.0 if is_near else distance_m(craft, first)
            if metres > PLAIN_LEG_M and metres > distance_m(home, first):
                self.carried_m = distance_m(craft, home)
        is_craft = craft is not None and not self.carried_m
        self.place = craft if is_craft else home
        self.name = "the craft" if is_craft else "home"
        self.places = (craft, home)
        self.assumed = ("the craft is at the list's home",) if craft is None and home is not None else ()

    def carried(self) -> Judgement:
        """Only from there is the list flown."""
        return Judgement(None, "", f"flown only from the list's home, {in_metres(self.carried_m)} off", News.WARNING)


class Leg(NamedTuple):
    """One leg. target: the place in the list of the record flown to. cause: the same, or that of the JUMP before it.

    start_cm, end_cm: heights above home, or None if unknown. is_first: the way to the first record, of no length if the
    departure is unknown. roi: the region of interest meanwhile.
    """

    target: int
    cause: int
    start: Place
    end: Place
    length_m: float
    start_cm: int | None
    end_cm: int | None
    is_first: bool = False
    is_return: bool = False
    roi: Place | None = None


class FlownPath:
    """legs: each once, in the order in which they are flown first. has_loops: some are flown several times.

    highest_cm: of the legs before the return.
    """

    def __init__(self, legs: Sequence[Leg] = (), *, lands: bool = False, has_loops: bool = False) -> None:
        self.legs = legs
        self._lands = lands
        self._has_loops = has_loops
        self.length_m, self.highest_cm = 0.0, 0
        self._has_unknown_height = False
        for leg in legs:
            self.length_m += leg.length_m
            if leg.is_return:
                continue
            if leg.end_cm is None:
                self._has_unknown_height = True
            elif leg.end_cm > self.highest_cm:
                self.highest_cm = leg.end_cm

    def facts(self) -> tuple[str, ...]:
        """The flight in words, for one sentence."""
        words = [in_metres(self.length_m) + " a round" * self._has_loops]
        words += [] if self._has_unknown_height else [f"highest {self.highest_cm / 100:g} m"]
        for leg in self.legs:
            if leg.is_return:
                words.append("returns home" if leg.end_cm is None else f"returns home at {leg.end_cm / 100:g} m")
                break
        return (*words, "lands" if self._lands else "does not land")

    def shown(self, seqs: Sequence[int]) -> tuple[FlownLeg, ...]:
        """For drawings; seqs: the number of the item of each record."""
        shown: list[FlownLeg] = []
        for leg in self.legs:
            start, end = (leg.start.lat_e7, leg.start.lon_e7), (leg.end.lat_e7, leg.end.lon_e7)
            start_m = None if leg.start_cm is None else leg.start_cm / 100
            end_m = None if leg.end_cm is None else leg.end_cm / 100
            shown.append(FlownLeg(seqs[leg.target], start, end, round(leg.length_m, 1), start_m, end_m, leg.is_return))
        if shown and self._lands:
            last = shown[-1]
            shown.append(FlownLeg(last.seq, last.end, last.end, 0.0, last.end_m, 0.0))
        return tuple(shown)


def first_of(cases: Sequence[tuple[int, str]], field: str, news: News = News.DANGER) -> Iterable[Judgement]:
    """One judgement about all cases of a kind (the record's place, and the reason): the first, and how many more."""
    if not cases:
        return ()
    place, why = cases[0]
    more = f" (+{len(cases) - 1})" if len(cases) > 1 else ""
    return (Judgement(place, field, why + more, news),)


def beyond_plain_limits(
    path: FlownPath, departure: Departure, *, leg: bool = True, height: bool = True
) -> Iterable[Judgement]:
    """What a pilot hardly means, such as a swapped Lat/Long. leg, height: False if the board has a limit of its own."""
    long, far, high = [], [], []
    start = departure.place
    for each in path.legs:
        if leg and each.length_m > PLAIN_LEG_M:
            long.append((each.cause, f"{in_metres(each.length_m)} leg, over 2 km"))
        if height and not each.is_return and (each.end_cm or 0) > 100 * PLAIN_HEIGHT_M:
            high.append((each.target, f"{(each.end_cm or 0) / 100:g} m high"))
        if path.length_m > PLAIN_AWAY_M and start is not None and distance_m(start, each.end) > PLAIN_AWAY_M:
            metres = in_metres(distance_m(start, each.end))
            far.append((each.target, f"{metres} from {departure.name}, over 5 km"))
    if not (long or far or high):
        return ()
    return (*first_of(long, "lat_e7"), *first_of(far, "lat_e7"), *first_of(high, "alt_m", News.NOTICE))


def in_metres(metres: float) -> str:
    if metres < 1000:
        return f"{metres:.0f} m"
    return f"{metres / 1000:.1f} km" if metres < 100_000 else f"{metres / 1000:,.0f} km"
