# SPDX-License-Identifier: GPL-3.0-or-later
"""What the bridge says at Write about an INAV, confirmed by INAV's own SITL: it arms or not, and flies as said or not.

Flights take up to a minute each, in real time.
"""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from bridge.controllers.inav.limits import InavLimits
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.msp.inav_places import Corner, FenceAction, Geozone
from protocols.msp.nav import LAST, NavAction, NavMode, NavRecord
from protocols.msp.nav_items import home_item, items_from_records
from reports.finding import News
from reports.verdict import Result
from tests.support.inav_sitl import ANGLE, ARM, LAT_E7, LON_E7, NAV_WP, Sitl

_E7_PER_M = 89.93
_SLACK_M = 15


def leg(north_m: float, height_m: float = 15, action: NavAction = NavAction.WAYPOINT, **fields: int) -> NavRecord:
    return NavRecord(action, LAT_E7 + round(north_m * _E7_PER_M), LON_E7, round(height_m * 100), **fields)


def jump(target: int, repeats: int = 1) -> NavRecord:
    return NavRecord(NavAction.JUMP, p1=target, p2=repeats)


def circle(north_m: float, radius_m: int, action: FenceAction, *, is_inclusive: bool = False) -> Geozone:
    centre = Corner(LAT_E7 + round(north_m * _E7_PER_M), LON_E7)
    return Geozone(0, is_inclusive, (centre,), radius_m * 100, action=action)


def said(records: Sequence[NavRecord], **limits: object) -> tuple[Result, list[str], list[str]]:
    """The verdict, dangers and all other texts for a craft on the field."""
    items = items_from_records(records, home_item((LAT_E7, LON_E7)))
    rules = NavRules(NavProfile(limits=InavLimits(**limits)))  # type: ignore[arg-type]
    verdict = check_list(items, rules, (LAT_E7, LON_E7))
    dangers = [finding.text() for finding in verdict.findings if finding.news is News.DANGER]
    return verdict.result, dangers, [finding.text() for finding in verdict.findings]


def fly(sitl: Sitl, records: Sequence[NavRecord], *switches: int) -> None:
    """Arm and begin the mission."""
    sitl.run(4)
    sitl.write(ended(records))
    sitl.run(1)
    sitl.switch(ARM, *switches)
    sitl.run(1)
    assert sitl.is_armed(), sitl.blockers()
    sitl.channels[2] = 1500
    sitl.switch(ARM, NAV_WP, *switches)


def ended(records: Sequence[NavRecord]) -> list[NavRecord]:
    return [*records[:-1], replace(records[-1], flag=LAST)]


LISTS: dict[str, tuple[NavRecord, ...]] = {
    "first near": (leg(60), leg(300)),
    "first far": (leg(150), leg(60)),
    "first is a distant ROI": (leg(150, action=NavAction.SET_POI), leg(60)),
    "jump": (leg(60), leg(90), leg(60), jump(1)),
    "jump to the adjacent": (leg(60), leg(90), jump(2)),
    "jump to a ROI": (leg(60), leg(90, action=NavAction.SET_POI), leg(60), leg(90), jump(2)),
    "return without landing": (leg(60), NavRecord(NavAction.RTH)),
    "landing": (leg(60), leg(90, action=NavAction.LAND)),
}


def test_it_arms_exactly_with_the_lists_that_the_rules_accept(sitl: Sitl) -> None:
    sitl.configure()
    sitl.run(5)
    assert sitl.blockers() == ()
    blocked = {}
    for name, records in LISTS.items():
        sitl.write(ended(records))
        sitl.run(1)
        blocked[name] = "navigation unsafe" in sitl.blockers()
    assert blocked == {name: said(records)[0] is Result.REJECTED for name, records in LISTS.items()}
    assert sorted(name for name, is_blocked in blocked.items() if is_blocked) == [
        "first far",
        "first is a distant ROI",
        "jump to a ROI",
        "jump to the adjacent",
    ]


@pytest.mark.parametrize(
    ("zone", "arms"),
    [
        (circle(0, 50, FenceAction.NONE), False),
        (circle(300, 50, FenceAction.NONE), True),
        (circle(300, 50, FenceAction.NONE, is_inclusive=True), False),
        (circle(0, 50, FenceAction.NONE, is_inclusive=True), True),
        (circle(9000, 50, FenceAction.NONE, is_inclusive=True), True),
    ],
)
def test_it_arms_exactly_in_the_zones_that_the_rules_accept(sitl: Sitl, zone: Geozone, arms: bool) -> None:
    sitl.configure(zones=[zone])
    sitl.run(6)
    assert ("geozone" not in sitl.blockers()) == arms
    assert (said((leg(20), leg(40)), zones=(zone,))[0] is Result.ACCEPTED) == arms


@pytest.mark.parametrize(
    ("zone", "switches", "stops", "text"),
    [
        (circle(300, 50, FenceAction.POS_HOLD), [ANGLE], True, "geozone 0: flown, or a stop if ANGLE is on"),
        (circle(300, 50, FenceAction.POS_HOLD), [], False, "geozone 0: flown, or a stop if ANGLE is on"),
        (circle(300, 50, FenceAction.NONE), [ANGLE], False, "geozone 0: flown, no action is set"),
        (circle(0, 250, FenceAction.POS_HOLD, is_inclusive=True), [ANGLE], True, "leaves zones: flown, or a stop"),
    ],
)
def test_a_mission_stops_at_a_zone_as_said(
    sitl: Sitl, zone: Geozone, switches: list[int], stops: bool, text: str
) -> None:
    records = leg(60), leg(450)
    sitl.configure(zones=[zone], nav_auto_speed=1000)
    fly(sitl, records, *switches)
    sitl.run(65)
    held = sitl.nav_status().mode == NavMode.HOLD
    assert (held, sitl.place[0] < 200) == (stops, stops)
    assert text in " ".join(said(records, zones=(zone,))[2])


def test_it_returns_from_a_zone_with_that_action(sitl: Sitl) -> None:
    zone = circle(300, 50, FenceAction.RTH)
    records = leg(60), leg(450)
    sitl.configure(zones=[zone], nav_auto_speed=1000)
    fly(sitl, records, ANGLE)
    sitl.run(45)
    assert sitl.nav_status().mode == NavMode.RTH
    assert sitl.place[0] < 100
    assert said(records, zones=(zone,))[1] == ["WP 2: geozone 0: flown, or a return if ANGLE is on"]


@pytest.mark.parametrize(("asked_cm_s", "flown_m_s"), [(1200, 7.0), (600, 6.0)])
def test_a_leg_is_flown_at_the_speed_that_is_said(sitl: Sitl, asked_cm_s: int, flown_m_s: float) -> None:
    records = leg(60, p1=asked_cm_s), leg(400, p1=asked_cm_s)
    sitl.configure(nav_max_auto_speed=700)
    fly(sitl, records)
    sitl.run(20)
    fastest = 0.0
    for _ in range(20):
        sitl.run(0.5)
        fastest = max(fastest, sitl.speed_m_s)
    assert fastest == pytest.approx(flown_m_s, abs=1.0)
    told = [text for text in said(records, nav_max_auto_speed=700)[2] if "nav_max_auto_speed" in text]
    assert bool(told) == (asked_cm_s > 700)


@pytest.mark.parametrize("lands", [False, True])
def test_a_return_lands_only_if_the_param1_says_so(sitl: Sitl, lands: bool) -> None:
    records = leg(40), NavRecord(NavAction.RTH, p1=int(lands))
    sitl.configure(nav_auto_speed=1000)
    fly(sitl, records)
    sitl.run(70)
    assert sitl.is_armed() != lands
    items = items_from_records(ended(records), home_item((LAT_E7, LON_E7)))
    flight = check_list(items, NavRules(NavProfile()), (LAT_E7, LON_E7)).flight
    assert flight[-1] == ("lands" if lands else "does not land")


def test_above_nav_max_altitude_it_would_fly_lower_and_the_list_is_refused(sitl: Sitl) -> None:
    records = leg(40, 30), leg(150, 30)
    sitl.configure(nav_max_altitude=1200)
    fly(sitl, records)
    sitl.run(45)
    assert sitl.place[2] < 12 + _SLACK_M / 5
    result, _, texts = said(records, nav_max_altitude=1200)
    assert (result, texts) == (
        Result.REJECTED,
        ["Rejected, WP 1: nav_max_altitude is 12 m, it would not climb to 30 m"],
    )
