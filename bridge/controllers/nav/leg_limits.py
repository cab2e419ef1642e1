# SPDX-License-Identifier: GPL-3.0-or-later
"""Legs that a MultiWii flies differently because of its settings (docs/inav.md)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bridge.missions.flown_legs import Departure, FlownPath, Judgement, beyond_plain_limits, first_of
from bridge.model.ground_track import passing_distance_m
from protocols.msp.nav import NavRecord

#: A craft may stray this far from its line.
_STRAYS_M = 5


@dataclass(frozen=True, slots=True)
class LegLimits:
    """MultiWii's wp_radius, safe_wp_distance (it stops before a leg of this length) and nav_max_altitude."""

    radius_cm: int
    stops_at_m: int
    highest_m: int

    def return_cm(self, rth: NavRecord, _here_cm: int | None, _highest_cm: int) -> int | None:
        """Its own RTH altitude is not known."""
        return rth.alt_cm or None

    def judge(self, _records: Sequence[NavRecord], path: FlownPath, departure: Departure) -> Iterable[Judgement]:
        legs = [leg for leg in path.legs if not leg.is_return]
        high = f"flown at {self.highest_m} m, its nav_max_altitude"
        too_high = [leg for leg in path.legs if (leg.end_cm or 0) > 100 * self.highest_m]
        yield from first_of([(leg.target, high) for leg in too_high], "alt_m")
        stop = f"leg of {self.stops_at_m} m or more: stops there"
        yield from first_of([(leg.cause, stop) for leg in legs if leg.length_m >= self.stops_at_m], "lat_e7")
        # With a region of interest set, MultiWii compares its distance with wp_radius, not the waypoint's.
        near_m = self.radius_cm / 100 + _STRAYS_M
        near = f"passes the ROI within {near_m:g} m: may end there"
        passing = [leg for leg in legs if leg.roi and passing_distance_m(leg.start, leg.end, leg.roi) < near_m]
        yield from first_of([(leg.cause, near) for leg in passing], "lat_e7")
        yield from beyond_plain_limits(path, departure, leg=False, height=False)


#: MultiWii's defaults.
USUAL_LEGS = LegLimits(radius_cm=100, stops_at_m=500, highest_m=100)
