# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions and INAV's geozones."""

from dataclasses import replace
from typing import Any

import pytest

from bridge.controllers.inav.limits import InavLimits
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import inav_profile
from bridge.missions.list_check import check_list
from protocols.mission_item import MissionItem
from protocols.msp.inav_places import Corner, Geozone
from tests.support.nav_lists import HOME, LAT, LON, WP

#: 100 m to the north.
NORTH = 8983
EAST = 12788


def texts(*zones: Geozone, legs: tuple[MissionItem, ...], here: tuple[int, int] | None = None) -> list[str]:
    limits = InavLimits(nav_wp_max_safe_distance=0, zones=zones)
    verdict = check_list((HOME, *legs), NavRules(inav_profile(limits=limits)), here)
    return [finding.text() for finding in verdict.findings]


def at(north: float, east: float = 0.0, **fields: Any) -> MissionItem:
    """In units of 100 m."""
    return replace(WP, lat_e7=LAT + round(north * NORTH), lon_e7=LON + round(east * EAST), **fields)


def circle(north: float, east: float = 0.0, radius_m: int = 50, **fields: Any) -> Geozone:
    centre = Corner(LAT + round(north * NORTH), LON + round(east * EAST))
    return Geozone(0, fields.pop("is_inclusive", False), (centre,), radius_m * 100, **fields)


def square(north: float, size: float, *, is_inclusive: bool = False) -> Geozone:
    corners = [(north - size, -size), (north - size, size), (north + size, size), (north + size, -size)]
    places = tuple(Corner(LAT + round(n * NORTH), LON + round(e * EAST)) for n, e in corners)
    return Geozone(3, is_inclusive, places)


LEGS = at(1), at(3)
THROUGH = "WP 2: passes through geozone {} (exclusive): INAV does not stop a mission there"


@pytest.mark.parametrize(
    ("zone", "is_through"),
    [
        (circle(2), True),
        (circle(2, 0.4), True),
        (circle(2, 0.6), False),
        (circle(4), False),
        (square(2, 0.3), True),
        (square(4.2, 1), False),
        (circle(2, highest_cm=4000), False),
        (circle(2, highest_cm=6000), True),
        (circle(2, lowest_cm=6000), False),
        (circle(2, highest_cm=4000, is_above_sea=True), True),
    ],
)
def test_a_leg_through_an_exclusive_zone_is_a_warning(zone: Geozone, is_through: bool) -> None:
    """At 50 m; INAV flies it all the same."""
    assert texts(zone, legs=LEGS) == ([THROUGH.format(zone.number)] if is_through else [])


def test_a_waypoint_outside_of_the_inclusive_zones_is_a_warning() -> None:
    field = square(0, 2, is_inclusive=True)
    outside = "WP 2: outside of the inclusive geozones: INAV does not stop a mission there"
    assert texts(field, legs=LEGS) == [outside]
    assert texts(field, circle(3, is_inclusive=True), legs=LEGS) == []
    # Armed outside of all of them, INAV turns them off.
    assert texts(circle(30, is_inclusive=True), legs=LEGS) == []


def test_a_list_is_rejected_if_inav_would_not_arm_at_home() -> None:
    inside = "Mission rejected: Home is inside geozone 0 (exclusive): INAV would not arm"
    assert texts(circle(0), legs=LEGS) == [inside]
    assert texts(circle(0, lowest_cm=2000), legs=LEGS) == []
    outside = "Mission rejected: Home is outside geozone 0 (inclusive): INAV would not arm"
    assert texts(circle(10, is_inclusive=True), legs=LEGS) == [outside]
    # The craft is elsewhere, where it arms.
    assert texts(circle(0), legs=LEGS, here=(LAT - 2 * NORTH, LON)) == []
