# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own SITL stops at a geozone, or flies on, as the bridge says at Write."""

import pytest

from protocols.msp.inav_places import Corner, FenceAction, Geozone
from protocols.msp.nav import NavMode, NavRecord
from tests.support.inav_lists import circle, jump, leg, place, said
from tests.support.inav_sitl import ANGLE, Sitl

_STOP = "stops at {} if ANGLE is on"
INTO, OUT = _STOP.format("geozone 0"), _STOP.format("the zone border")
#: A U, open to the north: its arms reach from 100 m west to 60 m and from 60 m east to 100 m.
_CORNERS = ((-60, -120), (-60, 120), (400, 120), (400, 60), (60, 60), (60, -60), (400, -60), (400, -120))
U = Geozone(0, True, tuple(Corner(*place(*each)) for each in _CORNERS), action=FenceAction.POS_HOLD)
WAY = leg(60), leg(450)
#: The way back crosses a zone between two places outside of it.
ROUND = leg(20), leg(20, east_m=350), leg(360, east_m=350), leg(360)


@pytest.mark.parametrize(
    ("zone", "records", "switches", "stops", "text"),
    [
        (circle(300, 50, FenceAction.POS_HOLD), WAY, [ANGLE], True, INTO),
        (circle(300, 50, FenceAction.POS_HOLD), WAY, [], False, INTO),
        (circle(300, 50, FenceAction.NONE), WAY, [ANGLE], False, "geozone 0: crossed, no action is set"),
        (circle(300, 50, FenceAction.POS_HOLD, highest_cm=600), WAY, [ANGLE], False, ""),
        (circle(300, 50, FenceAction.POS_HOLD, lowest_cm=4000, highest_cm=9000), WAY, [ANGLE], False, ""),
        (circle(0, 250, FenceAction.POS_HOLD, is_inclusive=True), WAY, [ANGLE], True, OUT),
        (circle(0, 250, FenceAction.POS_HOLD, is_inclusive=True), WAY, [], False, OUT),
        (circle(0, 900, FenceAction.POS_HOLD, is_inclusive=True), WAY, [ANGLE], False, ""),
        (circle(190, 30, FenceAction.POS_HOLD), ROUND, [ANGLE], True, f"WP 1: {INTO}"),
        (circle(300, 30, FenceAction.POS_HOLD), ROUND, [ANGLE], False, ""),
        (circle(300, 30, FenceAction.POS_HOLD), (*ROUND, jump(1)), [ANGLE], True, f"WP 5: {INTO}"),
        (U, (leg(20), leg(20, east_m=90)), [ANGLE], True, OUT),
        (U, (leg(20), leg(20, east_m=90), leg(300, east_m=90), leg(300, east_m=-90)), [ANGLE], True, OUT),
    ],
)  # fmt: skip
def test_a_mission_stops_at_a_zone_as_reported(
    sitl: Sitl, zone: Geozone, records: tuple[NavRecord, ...], switches: list[int], stops: bool, text: str
) -> None:
    sitl.configure(zones=[zone], nav_auto_speed=1000)
    sitl.fly(records, *switches)
    seconds = 140 if len(records) > 3 else 65
    has_stopped = False
    for _ in range(seconds):
        sitl.run(1)
        has_stopped = has_stopped or sitl.nav_status().mode == NavMode.HOLD
        if has_stopped:
            break
    assert has_stopped == stops
    told = said(records, zones=(zone,))
    assert text in told if text else "zone" not in told


@pytest.mark.parametrize("switches", [[ANGLE], []])
def test_it_returns_from_a_zone_with_that_action(sitl: Sitl, switches: list[int]) -> None:
    zone = circle(300, 50, FenceAction.RTH)
    sitl.configure(zones=[zone], nav_auto_speed=1000)
    sitl.fly(WAY, *switches)
    sitl.run(45)
    assert (sitl.nav_status().mode == NavMode.RTH, sitl.place[0] < 100) == (bool(switches), bool(switches))
    assert "WP 2: returns at geozone 0 if ANGLE is on" in said(WAY, zones=(zone,))
