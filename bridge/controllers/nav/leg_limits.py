# SPDX-License-Identifier: GPL-3.0-or-later
"""Legs that a MultiWii flies differently because of its settings (docs/inav.md)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bridge.controllers.nav.judgement import Departure, Judgement
from bridge.model.ground_track import distance_m, passing_distance_m
from protocols.msp.nav import LEGS, TURNS, NavAction, NavRecord

#: A craft may stray this far from its line.
_STRAYS_M = 5


@dataclass(frozen=True, slots=True)
class LegLimits:
    """MultiWii's wp_radius, safe_wp_distance (it stops before a leg of this length) and nav_max_altitude."""

    radius_cm: int
    stops_at_m: int
    highest_m: int

    def judge(self, records: Sequence[NavRecord], departure: Departure) -> Iterable[Judgement]:
        """Each such leg, once; a leg after a JUMP has the JUMP's place."""
        return dict.fromkeys(_limited(records, self))


def _limited(records: Sequence[NavRecord], limits: LegLimits) -> Iterable[Judgement]:
    before: NavRecord | None = None
    roi: NavRecord | None = None
    near_m = limits.radius_cm / 100 + _STRAYS_M
    for place, target in _flown(records):
        record = records[target]
        if record.action not in TURNS and record.alt_cm > 100 * limits.highest_m:
            yield Judgement(target, "alt_m", f"flown at {limits.highest_m} m, the board's nav_max_altitude")
        if record.action in TURNS:
            roi = record if record.action == NavAction.SET_POI else None
        if record.action not in LEGS:
            continue
        if before is not None and distance_m(before, record) >= limits.stops_at_m:
            why = f"{limits.stops_at_m} m or more from the waypoint before: the mission stops there"
            yield Judgement(place, "lat_e7", why)
        # With a region of interest set, MultiWii compares its distance with wp_radius, not the waypoint's.
        if roi is not None and passing_distance_m(before or record, record, roi) < near_m:
            why = f"passes the ROI at less than {near_m:g} m: the board may end this leg there"
            yield Judgement(place, "lat_e7", why)
        before = record


def _flown(records: Sequence[NavRecord]) -> Iterable[tuple[int, int]]:
    """The places of the records as flown, each JUMP back taken once, with the JUMP's place before its target."""
    for place, record in enumerate(records):
        yield place, place
        if record.action == NavAction.JUMP and record.p2:
            target = record.p1 - 1
            yield place, target
            yield from ((inner, inner) for inner in range(target + 1, place))
