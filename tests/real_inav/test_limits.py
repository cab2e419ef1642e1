# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own settings, flown on INAV's own SITL as the bridge says at Write, and otherwise with another value."""

from statistics import median

import pytest

from bridge.controllers.inav.limits import RthAltMode, SafehomeUsageMode
from protocols.msp.inav_places import SET_SAFEHOME, Safehome
from protocols.msp.nav import NavAction, NavMode, NavRecord
from tests.support.inav_lists import is_refused, jump, leg, place, rth, said
from tests.support.inav_sitl import Sitl

_SLACK_M = 3
#: The first version whose nav_max_altitude applies to missions.
_LIMITS_MISSIONS = 8, 0, 0


@pytest.mark.parametrize(("limit_m", "enforce_cm", "flown_m"), [(12, 0, 12), (40, 0, 30), (0, 0, 30), (12, 200, 30)])
def test_a_list_above_nav_max_altitude_is_refused_where_it_would_fly_lower(
    sitl: Sitl, limit_m: int, enforce_cm: int, flown_m: int
) -> None:
    records = leg(40, 30), leg(100, 30)
    limits = {"nav_max_altitude": 100 * limit_m, "nav_wp_enforce_altitude": enforce_cm}
    sitl.configure(nav_max_altitude=100 * limit_m, nav_wp_enforce_altitude=enforce_cm)
    is_limited = sitl.version >= _LIMITS_MISSIONS and flown_m != 30
    sitl.fly(records)
    sitl.run(45)
    assert sitl.place[2] == pytest.approx(flown_m if is_limited else 30, abs=_SLACK_M)
    assert is_refused(records, version=sitl.version, **limits) == is_limited
    is_told = "over nav_max_altitude" in said(records, version=sitl.version, **limits)
    assert is_told == (sitl.version < _LIMITS_MISSIONS and flown_m != 30)


@pytest.mark.parametrize(("asked_cm_s", "flown_m_s"), [(1200, 7.0), (600, 6.0), (0, 3.0)])
def test_a_leg_is_flown_at_the_reported_speed(sitl: Sitl, asked_cm_s: int, flown_m_s: float) -> None:
    records = leg(60, p1=asked_cm_s), leg(400, p1=asked_cm_s)
    sitl.configure(nav_max_auto_speed=700, nav_auto_speed=300)
    sitl.fly(records)
    sitl.run(20)
    speeds = []
    for _ in range(20):
        sitl.run(0.5)
        speeds.append(sitl.speed_m_s)
    assert median(speeds) == pytest.approx(flown_m_s, abs=0.6)
    assert ("nav_max_auto_speed is 7 m/s" in said(records, nav_max_auto_speed=700)) == (asked_cm_s > 700)


@pytest.mark.parametrize(("away_m", "is_reached_at_once"), [(5, True), (25, False)])
def test_a_leg_within_nav_wp_radius_counts_as_reached_at_once(
    sitl: Sitl, away_m: float, is_reached_at_once: bool
) -> None:
    records = leg(40, action=NavAction.POSHOLD_TIME, p1=5), leg(40 + away_m), leg(120)
    sitl.configure(nav_wp_radius=1000)
    sitl.fly(records)
    seen = {1: 0.0, 2: 0.0, 3: 0.0}
    while not seen[3]:
        sitl.run(0.25)
        seen[sitl.nav_status().number] += 0.25
    assert (seen[2] < 1) == is_reached_at_once
    assert ("it may count as reached at once" in said(records, nav_wp_radius=1000)) == is_reached_at_once


@pytest.mark.parametrize(
    ("mode", "setting_m", "legs_m", "flown_m"),
    [
        ("CURRENT", 20, (12, 12), 12),
        ("EXTRA", 10, (12, 12), 22),
        ("FIXED", 20, (12, 12), 20),
        ("FIXED", 12, (22, 22), 12),
        ("MAX", 10, (22, 12), 22),
        ("AT_LEAST", 20, (12, 12), 20),
        ("AT_LEAST", 10, (22, 22), 22),
    ],
)
def test_a_return_flies_at_the_reported_height(
    sitl: Sitl, mode: str, setting_m: int, legs_m: tuple[int, int], flown_m: int
) -> None:
    climb = leg(40, legs_m[0], action=NavAction.POSHOLD_TIME, p1=10)
    records = climb, leg(90, legs_m[1]), rth()
    sitl.configure(nav_rth_alt_mode=mode, nav_rth_altitude=100 * setting_m, nav_auto_speed=600)
    sitl.fly(records)
    _until_return(sitl)
    while sitl.place[0] > 20:
        sitl.run(0.5)
    assert sitl.place[2] == pytest.approx(flown_m, abs=_SLACK_M)
    text = said(records, nav_rth_alt_mode=RthAltMode[mode], nav_rth_altitude=100 * setting_m)
    assert f"returns home at {flown_m} m" in text
    assert (f"RTH at nav_rth_altitude {setting_m} m, below" in text) == (flown_m < max(legs_m))


def _until_return(sitl: Sitl) -> None:
    for _ in range(200):
        sitl.run(0.5)
        if sitl.nav_status().mode == NavMode.RTH:
            return
    pytest.fail("it did not return")


@pytest.mark.parametrize(
    ("mode", "away_m", "returns_there"), [("RTH", 60, True), ("RTH", 140, False), ("RTH_FS", 60, False)]
)
def test_a_return_goes_to_the_reported_safehome(sitl: Sitl, mode: str, away_m: float, returns_there: bool) -> None:
    safehome = Safehome(0, True, *place(0, away_m))
    sitl.ask(SET_SAFEHOME, safehome.pack())
    sitl.configure(safehome_usage_mode=mode, safehome_max_distance=10000, nav_auto_speed=600)
    records = leg(40), rth()
    sitl.fly(records)
    _until_return(sitl)
    sitl.run(40)
    assert -sitl.place[1] == pytest.approx(away_m if returns_there else 0, abs=10)
    limits = {"safehome_usage_mode": SafehomeUsageMode[mode], "safehome_max_distance": 10000}
    assert ("returns to safehome 0" in said(records, safehomes=(safehome,), **limits)) == returns_there


def reached_by_jump(last: NavRecord, *, lands: bool) -> tuple[NavRecord, ...]:
    """A list whose RTH is flown, but is not the last record."""
    return leg(20), jump(5), leg(25), rth(lands=lands), leg(40), jump(3), last


@pytest.mark.parametrize(
    ("records", "lands"),
    [
        ((leg(25), rth(lands=True)), True),
        ((leg(25), rth()), False),
        (reached_by_jump(leg(60), lands=True), False),
        (reached_by_jump(leg(60, p1=300), lands=False), True),
        (reached_by_jump(leg(60), lands=False), False),
        ((leg(25), rth(lands=True), leg(60)), False),
    ],
)
def test_the_last_record_decides_if_a_return_lands(sitl: Sitl, records: tuple[NavRecord, ...], lands: bool) -> None:
    sitl.configure(nav_auto_speed=600, nav_rth_altitude=1000)
    sitl.fly(records)
    _until_return(sitl)
    sitl.run(50)
    assert sitl.is_armed() != lands
    asked = any(record.action == NavAction.RTH and record.p1 for record in records)
    if lands != asked and records[2].action != NavAction.WAYPOINT:
        assert is_refused(records)
    elif lands == asked:
        assert said(records).endswith(" / lands" if lands else " / does not land")


@pytest.mark.parametrize("throttle_us", [1000, 1500])
def test_it_takes_off_without_a_takeoff_record_at_low_throttle(sitl: Sitl, throttle_us: int) -> None:
    sitl.configure()
    sitl.fly((leg(20), leg(40)), throttle_us=throttle_us)
    sitl.run(15)
    assert sitl.place[2] > 2


@pytest.mark.parametrize(("is_above_sea", "flown_m"), [(True, 20), (False, 20)])
def test_a_height_counts_from_the_reported_level(sitl: Sitl, is_above_sea: bool, flown_m: float) -> None:
    records = leg(30, 151, p3=1) if is_above_sea else leg(30, 20), leg(60, 151, p3=1) if is_above_sea else leg(60, 20)
    sitl.configure()
    sitl.fly(records)
    sitl.run(40)
    assert sitl.place[2] == pytest.approx(flown_m, abs=_SLACK_M)
    assert "highest 20 m" in said(records)


_EAST_POI = leg(80, 15, 400, action=NavAction.SET_POI)


@pytest.mark.parametrize(
    ("turn", "heading"), [((), 0), ((NavRecord(NavAction.SET_HEAD, p1=90),), 90), ((_EAST_POI,), 90)]
)
def test_the_nose_turns_as_the_record_says(sitl: Sitl, turn: tuple[NavRecord, ...], heading: float) -> None:
    sitl.configure(nav_auto_speed=300)
    sitl.fly((leg(20), *turn, leg(150)))
    while sitl.place[0] < 70:
        sitl.run(1)
    off = (sitl.attitude[2] - heading + 180) % 360 - 180
    assert abs(off) < 15
