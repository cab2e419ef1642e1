# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions and INAV's geozones."""

from dataclasses import replace
from typing import Any

import pytest

from bridge.controllers.inav.limits import InavLimits
from bridge.controllers.inav.zone_check import zone_ahead
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.inav_places import Corner, FenceAction, Geozone
from tests.bridge.controllers.inav.test_mission_store import board_with
from tests.support.conversations import Upload
from tests.support.msp_bench import set_zone
from tests.support.nav_lists import HOME, LAT, LON, RTL_LANDS, WP, jump

HOLDS = FenceAction.POS_HOLD
ANGLE, NAV_WP = 1 << 3, 1 << 13
#: 100 m to the north.
NORTH = 8983
EAST = 12788


def texts(*zones: Geozone, legs: tuple[MissionItem, ...], here: tuple[int, int] | None = None) -> list[str]:
    limits = InavLimits(nav_wp_max_safe_distance=0, zones=zones)
    verdict = check_list((HOME, *legs), NavRules(NavProfile(limits=limits)), here)
    return [finding.text() for finding in verdict.findings]


def at(north: float, east: float = 0.0, **fields: Any) -> MissionItem:
    """In units of 100 m."""
    return replace(WP, lat_e7=LAT + round(north * NORTH), lon_e7=LON + round(east * EAST), **fields)


def circle(north: float, east: float = 0.0, radius_m: int = 50, **fields: Any) -> Geozone:
    centre = Corner(LAT + round(north * NORTH), LON + round(east * EAST))
    return Geozone(0, fields.pop("is_inclusive", False), (centre,), radius_m * 100, **{"action": HOLDS, **fields})


def square(north: float, size: float, *, is_inclusive: bool = False) -> Geozone:
    corners = [(north - size, -size), (north - size, size), (north + size, size), (north + size, -size)]
    places = tuple(Corner(LAT + round(n * NORTH), LON + round(e * EAST)) for n, e in corners)
    return Geozone(3, is_inclusive, places, action=HOLDS)


LEGS = at(1), at(3)
STOPS = "stops at {} if ANGLE is on"


@pytest.mark.parametrize(
    ("zone", "stops_at"),
    [
        (circle(2), 1),
        (circle(2, 0.4), 1),
        (circle(2, 0.6), 0),
        (circle(3, radius_m=49), 2),
        (circle(4.9), 2),
        (circle(5.1), 0),
        (square(2.9, 0.3), 2),
        (square(5.6, 1), 0),
        (circle(2, highest_cm=4000), 0),
        (circle(2, highest_cm=6000), 1),
        (circle(2, lowest_cm=6000), 0),
        (circle(2, highest_cm=4000, is_above_sea=True), 1),
    ],
)
def test_a_leg_towards_an_exclusive_zone_within_150_m_is_a_warning(zone: Geozone, stops_at: int) -> None:
    """At 50 m."""
    said = f"WP {stops_at}: " + STOPS.format(f"geozone {zone.number}")
    assert texts(zone, legs=LEGS) == ([said] if stops_at else [])


def test_the_board_may_stop_closer_to_a_zone() -> None:
    limits = InavLimits(nav_wp_max_safe_distance=0, zones=(circle(2),)).with_settings(
        {"geozone_mr_stop_distance": 4000}
    )
    verdict = check_list((HOME, *LEGS), NavRules(NavProfile(limits=limits)), None)
    assert [finding.text() for finding in verdict.findings] == ["WP 2: " + STOPS.format("geozone 0")]


def test_a_leg_out_of_the_inclusive_zones_is_a_warning() -> None:
    field = square(0, 2, is_inclusive=True)
    assert texts(field, legs=LEGS) == ["WP 1: " + STOPS.format("the zone border")]
    assert texts(field, circle(2.5, radius_m=250, is_inclusive=True), legs=LEGS) == []
    # Armed outside of all of them, INAV turns them off.
    assert texts(circle(30, is_inclusive=True), legs=LEGS) == []


def test_zones_are_judged_on_the_way_as_flown() -> None:
    """From the craft, after a jump, around a corner, and back home."""
    into, out = STOPS.format("geozone 0"), STOPS.format("the zone border")
    assert texts(circle(0.5, radius_m=20), legs=(at(1),)) == ["WP 1: " + into]
    corner = at(1), at(1, 2), at(4, 2), jump(1), at(4, 4)
    assert texts(circle(2.5, 1, 30), legs=corner) == ["WP 4: " + into]
    back = at(1), at(1, 2), RTL_LANDS
    assert texts(circle(0.5, 1, 30), legs=back) == ["WP 3: geozone 0: flown through, or around"]
    places = [(-3, -3), (3, -3), (3, -0.3), (0, 0.5), (3, 1.3), (3, 5), (-3, 5)]
    corners = tuple(Corner(LAT + round(n * NORTH), LON + round(e * EAST)) for n, e in places)
    concave = Geozone(1, True, corners, action=HOLDS)
    assert texts(concave, legs=(at(1, -1.4), at(1, 2))) == ["WP 2: " + out]
    assert texts(concave, legs=(at(0, -0.5), at(-0.5, 2))) == []


def test_only_the_first_stop_is_reported() -> None:
    assert texts(circle(2), legs=(at(1), at(3), at(1), at(3))) == ["WP 1: " + STOPS.format("geozone 0")]


def test_a_list_is_rejected_if_inav_would_not_arm_at_home() -> None:
    inside = "Mission rejected: Home is in geozone 0: INAV does not arm"
    assert texts(circle(0), legs=LEGS) == [inside]
    assert texts(circle(0, lowest_cm=6000), legs=LEGS) == []
    outside = "Mission rejected: Home is outside geozone 0: INAV does not arm"
    assert texts(circle(10, is_inclusive=True), legs=LEGS) == [outside]
    # The craft is elsewhere, where it arms.
    assert texts(circle(0), legs=LEGS, here=(LAT - 2 * NORTH, LON))[0] == "WP 1: " + STOPS.format("geozone 0")
    # The craft does not arm where it is, but at the home of the list.
    warning = "The craft is in geozone 0: INAV does not arm"
    assert texts(circle(-3), legs=LEGS, here=(LAT - 3 * NORTH, LON))[0] == warning


def test_a_zone_without_an_action_does_not_stop_a_mission() -> None:
    assert texts(circle(2, action=FenceAction.NONE), legs=LEGS) == ["WP 2: geozone 0: crossed, no action is set"]
    assert texts(circle(2, action=FenceAction.RTH), legs=LEGS) == ["WP 1: returns at geozone 0 if ANGLE is on"]


def test_the_nearest_border_with_an_action_is_named_where_a_mission_stops() -> None:
    place = Corner(LAT, LON)
    assert zone_ahead((circle(3, radius_m=150), square(5, 1)), place, 150) == "150 m from the border of geozone 0"
    assert zone_ahead((square(3, 2),), place, 150) == "100 m from the border of geozone 3"
    assert zone_ahead((circle(3), circle(2, action=FenceAction.NONE)), place, 150) == ""


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (FenceAction.POS_HOLD, "Holds: {} m from the border of geozone 0"),
        (FenceAction.RTH, "Returns: {} m from the border of geozone 0"),
        (FenceAction.NONE, ""),
    ],
)
def test_a_stop_at_a_zone_is_reported_once(action: FenceAction, said: str) -> None:
    """300 m to the north, with the switch of ANGLE on."""
    board, world, station = board_with(version="9.1.0")
    zone = circle(3, radius_m=30, action=action)
    set_zone(board, zone)
    world.inside.missions.settings_changed()
    first, second = at(0.9, alt_m=20.0), at(5, alt_m=20.0)
    assert Upload(station, [HOME, first, second]).run() is MissionResult.ACCEPTED
    station.take()
    board.faults.boxes = NAV_WP | ANGLE
    board.faults.armed = True
    world.run(100)
    texts = [text for text in station.texts() if "geozone" in text]
    assert len(texts) == bool(said)
    assert all(len(text) <= 50 and text == said.format(text.split()[1]) for text in texts)
