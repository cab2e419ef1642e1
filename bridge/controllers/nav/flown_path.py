# SPDX-License-Identifier: GPL-3.0-or-later
"""A list as INAV and MultiWii fly it (docs/inav.md).

Records are given by their place, from 0. A JUMP's p1 is a number, from 1.
"""

from collections.abc import Iterable, Sequence
from typing import Protocol

from bridge.missions.flown_legs import Departure, FlownPath, Judgement, Leg
from bridge.model.ground_track import Place, distance_m
from protocols.msp.nav import FLY_HOME, LEGS, TURNS, NavAction, NavRecord

_ENDLESS = -1
_ABOVE_SEA = 1


class BoardLimits(Protocol):
    """The settings of one board that decide about the missions."""

    def return_cm(self, rth: NavRecord, here_cm: int | None, highest_cm: int) -> int | None:
        """The height of a return that begins at `here_cm`, or None if unknown."""

    def assumed(self) -> Sequence[str]:
        """Each of them that is only assumed, with its value."""

    def judge(self, records: Sequence[NavRecord], path: FlownPath, departure: Departure) -> Iterable[Judgement]:
        """Whether, and how differently, the board flies these records."""


def fly(records: Sequence[NavRecord], departure: Departure, limits: BoardLimits | None, *, lands: bool) -> FlownPath:
    """The way of the records, each JUMP taken once. lands: after an RTH."""
    legs: dict[tuple[int, int, Place | None], Leg] = {}
    taken: set[int] = set()
    before = -1
    here, here_cm, highest_cm = departure.place, None, 0
    roi: Place | None = None
    place, cause = 0, None
    while place < len(records):
        record = records[place]
        if record.action == NavAction.JUMP and record.p2 and place not in taken:
            taken.add(place)
            place, cause = record.p1 - 1, place
            continue
        if (record.action, record.p2) == (NavAction.JUMP, _ENDLESS):
            break
        if record.action in TURNS:
            roi = record if record.action == NavAction.SET_POI else None
        is_return = record.action == NavAction.RTH
        if is_return or record.action in LEGS:
            end, end_cm = _end(record, departure), above_home_cm(record, departure)
            if is_return:
                end_cm = limits.return_cm(record, here_cm, highest_cm) if limits else None
            if end is not None:
                start = here or end
                start_cm, blamed = end_cm if here_cm is None else here_cm, place if cause is None else cause
                length_m = distance_m(start, end)
                leg = Leg(place, blamed, start, end, length_m, start_cm, end_cm, not legs, is_return, roi)
                legs.setdefault((before, place, roi), leg)
                before, here, here_cm, highest_cm = place, end, end_cm, max(highest_cm, end_cm or 0)
            cause = None
        if is_return or record.action == NavAction.LAND:
            lands = lands or record.action == NavAction.LAND
            return FlownPath(tuple(legs.values()), lands=lands, has_loops=bool(taken))
        place += 1
    return FlownPath(tuple(legs.values()), has_loops=bool(taken))


def _end(record: NavRecord, departure: Departure) -> Place | None:
    flies_home = record.action == NavAction.RTH or record.flag == FLY_HOME or not (record.lat_e7 or record.lon_e7)
    return departure.place if flies_home else record


def above_home_cm(record: NavRecord, departure: Departure) -> int | None:
    """The leg's height, or None if it is above sea level, and home's altitude is not known."""
    if not record.p3 & _ABOVE_SEA:
        return record.alt_cm
    return None if departure.altitude_m is None else record.alt_cm - round(100 * departure.altitude_m)


def flown_size(records: Sequence[NavRecord]) -> int:
    """The number of records up to the RTH that ends the mission, unless a JUMP leads beyond it."""
    for end, record in enumerate(records, 1):
        if record.action == NavAction.RTH and all(
            each.p1 <= end for each in records[:end] if each.action == NavAction.JUMP
        ):
            return end
    return len(records)


def lands_after_rth(records: Sequence[NavRecord]) -> bool:
    """True if an INAV lands after any RTH of the list: the last record's p1 decides, regardless of the action.

    INAV keeps a JUMP's target as an index, so one to the first record counts as 0.
    """
    last = records[-1]
    return last.p1 > (1 if last.action == NavAction.JUMP else 0)


def jump_within_jump(records: Sequence[NavRecord]) -> int | None:
    """The place of a JUMP whose loop contains another: MultiWii counts both with one counter, and never ends."""
    jumps = [place for place, record in enumerate(records) if record.action == NavAction.JUMP]
    for outer in jumps:
        if any(records[outer].p1 - 1 <= inner < outer for inner in jumps):
            return outer
    return None
