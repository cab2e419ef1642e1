# SPDX-License-Identifier: GPL-3.0-or-later
"""An INAV's own settings decide whether it arms with a list, and how it flies it: the answer comes at Write."""

import math
import struct
from dataclasses import replace
from typing import Any

import pytest

from bridge.controllers.inav.limits import InavLimits, Platform, RthAltMode, SafehomeUsageMode, readable, saved_limits
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.inav_places import FW_APPROACH, MISSION_APPROACH, SET_FW_APPROACH, FwApproach, Safehome
from protocols.settings_file import read_settings_file
from reports.finding import News, without_defaults
from tests.bridge.controllers.inav.test_mission_store import ACCEPTED, board_with
from tests.support.conversations import Upload
from tests.support.nav_lists import HOME, LAT, LON, RTL, RTL_LANDS, WP, item, speed
from tests.support.settings_client import SettingsClient

#: 100 m to the north.
NORTH = 8983
LAND = item(Command.NAV_LAND)
APPROACH = FwApproach(8, 5000, 350, turns_right=False, headings=(90, -10), is_above_sea=False)
BY_APPROACH_8 = "lands by FW approach 8: heading"
BY_APPROACH_3 = "lands by FW approach 3: heading 90 or 270 or 10"
DOWN = "circles down and lands in any direction: no FW approach"
NEAR, FAR = replace(WP, lat_e7=LAT + NORTH // 2), replace(WP, lat_e7=LAT + 2 * NORTH)


def texts(*items: MissionItem, here: tuple[int, int] | None = None, **limits: Any) -> list[str]:
    rules = NavRules(NavProfile(limits=InavLimits(**limits)))
    findings = without_defaults(check_list((HOME, *items), rules, here).findings)
    assert all(len(finding.text()) <= 50 for finding in findings if finding.news is News.DANGER)
    return [finding.text() for finding in findings]


YAW, ROI = item(Command.CONDITION_YAW, at=False, p1=90.0), item(Command.NAV_ROI)
HIGH = replace(WP, lat_e7=LAT + 60 * NORTH, alt_m=200.0)
#: Home is 123 m above the sea.
ABOVE_SEA = replace(WP, frame=0, alt_m=173.0)
CLOSE = replace(WP, lat_e7=LAT + NORTH // 50)
THERE = replace(LAND, lat_e7=LAT + NORTH)
AEROPLANE: dict[str, Any] = {"platform": Platform.AEROPLANE}
FIXED: dict[str, Any] = {"nav_rth_alt_mode": RthAltMode.FIXED}
SAFEHOME = Safehome(3, True, LAT + NORTH, LON)
NOT_ARMED = "Rejected, WP 1: 200 m from {}, nav_wp_max_safe_distance is 100 m: INAV would not arm"
TOO_LOW = "Rejected, WP 1: nav_max_altitude is 40 m: INAV would not climb to 50 m"
SELECTED = "Stored as mission 1, mission 2 was selected"
RETURNS = "returns to safehome 3, 100 m from home (safehome_max_distance is 200 m)"


@pytest.mark.parametrize(
    ("items", "limits", "said"),
    [
        ((FAR, NEAR), {}, [NOT_ARMED.format("home")]),
        ((FAR,), {"here": (LAT, LON + 1000)}, [NOT_ARMED.format("the craft")]),
        ((NEAR, FAR), {}, []),
        ((FAR,), {"nav_wp_max_safe_distance": 0}, []),
        ((FAR,), {"nav_wp_max_safe_distance": 201}, []),
        # INAV's home is where it is armed, whatever the home of the list.
        ((FAR,), {"here": (LAT + 2 * NORTH, LON)}, []),
        ((NEAR,), {"here": (LAT + NORTH * 5 // 2, LON)}, ["WP 1: arms only near the list's home, 250 m off"]),
        ((NEAR, speed(12), WP, FAR), {}, ["WP 3: 12 m/s, nav_max_auto_speed is 10 m/s (+1)"]),
        ((NEAR, speed(12), FAR), {"nav_max_auto_speed": 1200}, []),
        (
            (NEAR, speed(12), FAR, YAW, NEAR, ROI, FAR),
            AEROPLANE,
            ["WP 3: speed ignored on an aeroplane (+2)", "WP 4: no effect on an aeroplane (+1)"],
        ),
        # INAV itself has no such limits.
        (
            (NEAR, HIGH, RTL_LANDS),
            {},
            ["WP 2: 5.9 km leg, over 2 km (+1)", "WP 2: 6.0 km from home, over 5 km", "WP 2: 200 m high"],
        ),
        ((WP,), {"nav_max_altitude": 4000}, [TOO_LOW]),
        ((WP,), {"nav_max_altitude": 5000}, []),
        ((WP,), {"nav_max_altitude": 4000, "nav_wp_enforce_altitude": 100}, []),
        ((ABOVE_SEA,), {"nav_max_altitude": 4000}, [TOO_LOW]),
        ((ABOVE_SEA,), {"nav_max_altitude": 5000}, []),
        ((WP,), {"nav_max_altitude": 4000, "version": (7, 1, 2)}, ["WP 1: 50 m, over nav_max_altitude 40 m"]),
        ((WP,), {"nav_max_altitude": 5000, "version": (7, 1, 2)}, []),
        (
            (WP, CLOSE),
            {"nav_wp_radius": 500},
            ["WP 2: 2.0 m from the waypoint before, within nav_wp_radius (5 m): it may count as reached at once"],
        ),
        ((WP, CLOSE), {"nav_wp_radius": 100}, []),
        ((WP, RTL_LANDS), {}, []),
        ((WP, RTL), {}, []),
        ((WP, RTL_LANDS), FIXED, ["WP 2: RTH at nav_rth_altitude 10 m, below 50 m"]),
        ((WP, RTL_LANDS), FIXED | {"nav_rth_altitude": 5000}, []),
        ((WP, RTL_LANDS), {"safehomes": (Safehome(0, False, LAT, LON), SAFEHOME)}, [f"WP 2: {RETURNS}"]),
        ((WP, RTL_LANDS), {"safehomes": (SAFEHOME,), "safehome_usage_mode": SafehomeUsageMode.RTH_FS}, []),
        ((WP, RTL_LANDS), {"safehomes": (Safehome(3, True, LAT + 3 * NORTH, LON),)}, []),
        ((WP,), {"selected": 2}, [SELECTED]),
        (
            (NEAR,),
            AEROPLANE | {"selected": 2, "approach": APPROACH},
            [f"{SELECTED}: each mission lands by the FW approach with the new number"],
        ),
        ((NEAR,), AEROPLANE | {"selected": 2}, [SELECTED]),
        ((WP, THERE), AEROPLANE, [f"WP 2: {DOWN}"]),
        ((WP, THERE), AEROPLANE | {"approach": APPROACH._replace(headings=(0, 0))}, [f"WP 2: {DOWN}"]),
        ((WP, THERE), AEROPLANE | {"approach": APPROACH}, [f"WP 2: {BY_APPROACH_8} 90 or 270 or 10"]),
        (
            (WP, THERE),
            AEROPLANE | {"approach": APPROACH._replace(headings=(0, 360), is_above_sea=True)},
            [f"WP 2: {BY_APPROACH_8} 0 or 180"],
        ),
        ((WP, THERE), {}, []),
        ((WP, THERE), {"approach": APPROACH}, []),
    ],
)
def test_what_inav_flies_otherwise_than_the_list_is_named(
    items: tuple[MissionItem, ...], limits: dict[str, Any], said: list[str]
) -> None:
    assert texts(*items, **limits) == said


def test_inav_before_8_flies_above_nav_max_altitude() -> None:
    board, _, station = board_with(version="7.1.2")
    board._firmware._settings["nav_max_altitude"] = 5000  # type: ignore[union-attr]
    assert Upload(station, [HOME, replace(NEAR, alt_m=20.0), replace(FAR, alt_m=60.0)]).run() is ACCEPTED
    assert "WP 2: 60 m, over nav_max_altitude 50 m" in " ".join(station.texts())


@pytest.mark.parametrize("platform", [Platform.ROVER, Platform.BOAT])
def test_differences_on_a_rover_or_boat_are_named(platform: Platform) -> None:
    hold, land = item(Command.NAV_LOITER_TIME, p1=5.0), replace(FAR, command=Command.NAV_LAND)
    assert sorted(texts(speed(3), NEAR, hold, land, platform=platform)) == [
        f"WP 2: Alt ignored on {platform.value} (+2)",
        f"WP 2: speed ignored on {platform.value} (+2)",
        f"WP 3: {platform.value} drives on while it holds",
        f"WP 4: {platform.value} disarms there",
    ]


@pytest.mark.parametrize(
    ("safehome", "usage", "news"),
    [
        (None, SafehomeUsageMode.RTH, [DOWN]),
        (Safehome(3, True, LAT + 3 * NORTH, LON, APPROACH._replace(number=3)), SafehomeUsageMode.RTH, [DOWN]),
        (SAFEHOME, SafehomeUsageMode.RTH, [RETURNS, DOWN]),
        (SAFEHOME._replace(approach=FwApproach(3)), SafehomeUsageMode.RTH, [RETURNS, DOWN]),
        (SAFEHOME._replace(approach=APPROACH._replace(number=3)), SafehomeUsageMode.RTH, [RETURNS, BY_APPROACH_3]),
        (SAFEHOME._replace(approach=APPROACH._replace(number=3)), SafehomeUsageMode.OFF, [BY_APPROACH_3]),
        (SAFEHOME._replace(approach=FwApproach(3)), SafehomeUsageMode.OFF, [DOWN]),
    ],
)
def test_how_an_aeroplane_lands_after_the_return_is_named(
    safehome: Safehome | None, usage: SafehomeUsageMode, news: list[str]
) -> None:
    limits: dict[str, Any] = {"safehomes": (safehome,) if safehome else (), "safehome_usage_mode": usage}
    assert texts(WP, RTL_LANDS, **AEROPLANE, **limits) == [f"WP 2: {each}" for each in news]
    assert not any("lands" in text and "FW" in text for text in texts(WP, RTL_LANDS, **limits))
    assert not any("FW" in text for text in texts(WP, RTL, **AEROPLANE, **limits))


def test_an_aeroplanes_approach_is_read_and_the_mission_loaded_because_only_then_inav_uses_it() -> None:
    board, world, station = board_with(version="9.0.1", platform=1)
    firmware = board._firmware
    approach = struct.pack("<BiiBhhB", MISSION_APPROACH, 4000, 0, 0, -90, 0, 0)
    firmware._places.answer(SET_FW_APPROACH, approach)  # type: ignore[union-attr]
    client = SettingsClient(world)
    client.wait_read()
    client.change("nav_wp_radius", 200)
    assert Upload(station, [HOME, NEAR, replace(LAND, lat_e7=LAT + NORTH)]).run() is ACCEPTED
    assert "WP 2: lands by FW approach 8: heading 90" in " ".join(station.texts())
    assert firmware._mission._loaded == 1  # type: ignore[union-attr]
    assert firmware._places.answer(FW_APPROACH, bytes((MISSION_APPROACH,))) == approach  # type: ignore[union-attr]


def test_a_version_without_approaches_is_named() -> None:
    _, _, station = board_with(version="6.1.1", platform=1)
    assert Upload(station, [HOME, NEAR, replace(LAND, lat_e7=LAT + NORTH)]).run() is ACCEPTED
    assert "WP 2: circles down and lands in any direction" in " ".join(station.texts())


def test_the_boards_settings_are_read_by_name_and_again_after_a_change() -> None:
    _, world, station = board_with()
    legs = [HOME, replace(NEAR, alt_m=20.0), replace(FAR, alt_m=60.0)]
    assert Upload(station, legs).run() is ACCEPTED
    client = SettingsClient(world)
    client.wait_read()
    client.change("nav_max_altitude", 5000)
    assert Upload(station, legs).run() is MissionResult.INVALID_PARAM7
    assert "Rejected, WP 2: nav_max_altitude is 50 m: INAV would not climb to 60 m" in " ".join(station.texts())
    client.change("nav_max_altitude", 6000)
    assert Upload(station, legs).run() is ACCEPTED


def test_a_change_by_another_client_counts_at_the_next_write() -> None:
    board, _, station = board_with()
    legs = [HOME, replace(NEAR, alt_m=20.0), replace(FAR, alt_m=60.0)]
    assert Upload(station, legs).run() is ACCEPTED
    board._firmware._settings["nav_max_altitude"] = 5000  # type: ignore[union-attr]
    assert Upload(station, legs).run() is MissionResult.INVALID_PARAM7


DUMP = f"""# INAV/SITL 9.1.0
batch start
safehome 0 1 {LAT + NORTH} {LON}
safehome 1 0 0 0
set nav_wp_max_safe_distance = 1500
set nav_rth_alt_mode = FIXED
set nav_rth_altitude = 2000
battery_profile 1
set vbat_warning_cell_voltage = 350
battery_profile 2
set vbat_warning_cell_voltage = 300
"""


def test_settings_are_read_from_a_dump_and_from_a_param_file() -> None:
    limits = saved_limits(read_settings_file(DUMP.encode(), "dump.txt"))
    assert limits == InavLimits(
        unknown=("nav_max_altitude",),
        nav_wp_max_safe_distance=1500,
        nav_rth_alt_mode=RthAltMode.FIXED,
        nav_rth_altitude=2000,
        safehomes=(Safehome(0, True, LAT + NORTH, LON), Safehome(1, False, 0, 0)),
    )
    params = read_settings_file(b"# board: INAV 9.1.0\nnav_max_altitude,12000\nnav_rth_alt_mode,2\n", "a.param")
    unknown = "nav_wp_max_safe_distance", "nav_rth_altitude"
    expected = InavLimits(nav_max_altitude=12000, nav_rth_alt_mode=RthAltMode.FIXED, unknown=unknown)
    assert saved_limits(params) == expected


@pytest.mark.parametrize("value", [math.inf, math.nan, 10**400, "high"])
def test_a_boards_value_of_another_type_counts_as_unknown(value: float | str) -> None:
    assert readable({"nav_max_altitude": value, "nav_rth_altitude": 2000, "other": "x"}).keys() == {
        "nav_rth_altitude",
        "other",
    }


def test_a_value_unknown_to_inav_is_refused() -> None:
    with pytest.raises(ValueError, match="nav_max_altitude cannot be '1e400'"):
        saved_limits(read_settings_file(b"set nav_max_altitude = 1e400\n", "dump.txt"))
    with pytest.raises(ValueError, match="nav_rth_alt_mode cannot be 'SOMETIMES'"):
        saved_limits(read_settings_file(b"set nav_rth_alt_mode = SOMETIMES\n", "dump.txt"))
