# SPDX-License-Identifier: GPL-3.0-or-later
"""Legs that a MultiWii does not fly as they are shown."""

from dataclasses import replace

from bridge.controllers.nav.check import NavRules
from protocols.mission_item import MissionItem
from tests.support.nav_lists import (
    INAV,
    LAT,
    LON,
    MULTIWII,
    WP,
    C,
    findings_for,
    item,
    jump,
    verdict_on,
)


def test_a_warning_for_legs_at_which_a_multiwii_stops() -> None:
    """Waypoints 400 m apart: only the jump back is too long. A heading change in between is not a leg."""
    second, third = (replace(WP, lat_e7=LAT + 36_000 * place) for place in (1, 2))
    yaw = item(C.CONDITION_YAW, at=False, p1=90.0)
    legs = (WP, second, yaw, third, jump(1), third)
    assert findings_for(*legs, rules=MULTIWII) == [(5, "lat_e7", 0, 0)]
    assert findings_for(*legs) == []


def test_a_warning_for_legs_that_a_multiwii_ends_at_a_region_of_interest() -> None:
    """By default within 1 m of it, and a craft strays by 5 m."""

    def north(metres: float, command: int = C.NAV_WAYPOINT, east: float = 0.0) -> MissionItem:
        return item(command, lat_e7=LAT + round(metres * 90), lon_e7=LON + round(east * 128))

    def warned(*items: MissionItem, rules: NavRules = MULTIWII) -> list[int | None]:
        return [finding.seq for finding in verdict_on(*items, rules=rules).findings if finding.is_warning]

    roi, aside, none = north(50, C.NAV_ROI), north(50, C.NAV_ROI, east=7), item(C.DO_SET_ROI_NONE, at=False)
    assert warned(north(0), roi, north(100), north(200)) == [3]
    assert warned(north(0), north(50, C.NAV_ROI, east=5), north(100)) == [3]
    assert warned(north(0), aside, north(100)) == []
    assert warned(north(0), roi, north(100), rules=INAV) == []
    assert warned(north(0), roi, none, north(100)) == []
    assert warned(north(0), roi, item(C.CONDITION_YAW, at=False, p1=90), north(100)) == []
    assert warned(roi, north(50)) == [2]
    # After the jump, the ROI is in force on the earlier legs, too.
    assert warned(north(0), north(100), roi, north(120), north(140), jump(1), north(160)) == [6]
    assert warned(north(0), north(100), roi, north(120), north(140), none, jump(1), north(160)) == []
