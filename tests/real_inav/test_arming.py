# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own SITL arms exactly with the lists, and in the zones, that the rules at Write accept."""

import pytest

from protocols.msp.inav_places import FenceAction, Geozone
from protocols.msp.nav import Nav, NavAction, NavRecord, decode_info
from protocols.msp.nav_items import home_item, items_from_records
from tests.support.inav_lists import circle, ended, is_refused, jump, leg, rth
from tests.support.inav_sitl import Sitl

LISTS: dict[str, tuple[NavRecord, ...]] = {
    "first near": (leg(60), leg(300)),
    "first far": (leg(150), leg(60)),
    "first is a distant ROI": (leg(150, action=NavAction.SET_POI), leg(60)),
    "jump": (leg(60), leg(90), leg(60), jump(1)),
    "jump to the adjacent": (leg(60), leg(90), jump(2)),
    "jump to a ROI": (leg(60), leg(90, action=NavAction.SET_POI), leg(60), leg(90), jump(2)),
    "return without landing": (leg(60), rth()),
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
    assert blocked == {name: is_refused(records) for name, records in LISTS.items()}
    assert sorted(name for name, is_blocked in blocked.items() if is_blocked) == [
        "first far",
        "first is a distant ROI",
        "jump to a ROI",
        "jump to the adjacent",
    ]


@pytest.mark.parametrize("limit_m", [0, 100, 200])
def test_a_distant_first_place_arms_within_nav_wp_max_safe_distance(sitl: Sitl, limit_m: int) -> None:
    records = leg(150), leg(60)
    sitl.configure(nav_wp_max_safe_distance=limit_m)
    sitl.run(5)
    sitl.write(ended(records))
    sitl.run(1)
    is_blocked = "navigation unsafe" in sitl.blockers()
    assert is_blocked == is_refused(records, nav_wp_max_safe_distance=limit_m) == (limit_m == 100)


@pytest.mark.parametrize(
    ("zone", "arms"),
    [
        (circle(0, 50, FenceAction.NONE), False),
        (circle(300, 50, FenceAction.NONE), True),
        (circle(300, 50, FenceAction.NONE, is_inclusive=True), False),
        (circle(0, 50, FenceAction.NONE, is_inclusive=True), True),
        (circle(9000, 50, FenceAction.NONE, is_inclusive=True), True),
        (circle(0, 50, FenceAction.NONE, lowest_cm=3000, highest_cm=9000), True),
    ],
)
def test_it_arms_exactly_in_the_zones_that_the_rules_accept(sitl: Sitl, zone: Geozone, arms: bool) -> None:
    sitl.configure(zones=[zone])
    sitl.run(6)
    assert ("geozone" not in sitl.blockers()) == arms
    assert is_refused((leg(20), leg(40)), zones=(zone,)) != arms


def test_it_stores_exactly_the_records_of_the_rules(sitl: Sitl) -> None:
    """An acknowledged SET_WP is not stored: LOITER_UNLIM as POSHOLD_UNLIM, and a record beyond the capacity."""
    sitl.configure()
    sitl.run(1)

    def stored(records: list[NavRecord]) -> int:
        sitl.write(ended(records))
        info = decode_info(sitl.ask(Nav.GETINFO).payload)
        assert info is not None
        return info.count

    endless = leg(60, action=NavAction.POSHOLD_UNLIM)
    assert stored([leg(40), endless]) < 2
    made = [leg(40), leg(60, action=NavAction.POSHOLD_TIME, p1=32767)]
    assert stored(made) == 2
    assert items_from_records(made, home_item(None))[2].command == 17
    many = [leg(40)] * 121
    assert stored(many) == 120
    assert (is_refused(many[:120]), is_refused(many)) == (False, True)
