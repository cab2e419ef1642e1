# SPDX-License-Identifier: GPL-3.0-or-later
"""An INAV's own settings decide whether it arms with a list, and how it flies it: the answer comes at Write."""

import struct
from dataclasses import replace
from typing import Any

import pytest

from bridge.controllers.inav.limits import InavLimits, Platform, RthAltMode, SafehomeUsageMode, saved_limits
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
BY_APPROACH_3 = "FW approach 3: heading 90 or 270 or 10"
DOWN = "circles down and lands in any direction: no FW approach"
NEAR, FAR = replace(WP, lat_e7=LAT + NORTH // 2), replace(WP, lat_e7=LAT + 2 * NORTH)


def texts(*items: MissionItem, here: tuple[int, int] | None = None, **limits: Any) -> list[str]:
    rules = NavRules(NavProfile(limits=InavLimits(**limits)))
    findings = without_defaults(check_list((HOME, *items), rules, here).findings)
    assert all(len(finding.text()) <= 50 for finding in findings if finding.news is News.DANGER)
    return [finding.text() for finding in findings]


def test_a_first_waypoint_at_which_inav_would_not_arm_rejects_the_list() -> None:
    reason = "200 m from {}, nav_wp_max_safe_distance is 100 m: INAV would not arm"
    assert texts(FAR, NEAR) == [f"Rejected, WP 1: {reason.format('home')}"]
    assert texts(FAR, here=(LAT, LON + 1000)) == [f"Rejected, WP 1: {reason.format('the craft')}"]
    assert texts(NEAR, FAR) == texts(FAR, nav_wp_max_safe_distance=0) == texts(FAR, nav_wp_max_safe_distance=201) == []


def test_the_first_waypoint_is_measured_from_the_craft() -> None:
    """INAV's home is where it is armed, whatever the home of the list."""
    assert texts(FAR, here=(LAT + 2 * NORTH, LON)) == []
    warning = "WP 1: arms only near the list's home, 250 m off"
    assert texts(NEAR, here=(LAT + NORTH * 5 // 2, LON)) == [warning]


def test_a_speed_that_a_multirotor_does_not_fly_is_named() -> None:
    assert texts(NEAR, speed(12), WP, FAR) == ["WP 3: 12 m/s, nav_max_auto_speed is 10 m/s (+1)"]
    assert texts(NEAR, speed(12), FAR, nav_max_auto_speed=1200) == []


def test_values_that_an_aeroplane_ignores_are_named() -> None:
    yaw = item(Command.CONDITION_YAW, at=False, p1=90.0)
    assert texts(NEAR, speed(12), FAR, yaw, FAR, item(Command.NAV_ROI), FAR, platform=Platform.AEROPLANE)[:2] == [
        "WP 3: speed ignored on an aeroplane (+2)",
        "WP 4: no effect on an aeroplane (+1)",
    ]


@pytest.mark.parametrize("platform", [Platform.ROVER, Platform.BOAT])
def test_differences_on_a_rover_or_boat_are_named(platform: Platform) -> None:
    hold, land = item(Command.NAV_LOITER_TIME, p1=5.0), replace(FAR, command=Command.NAV_LAND)
    assert sorted(texts(speed(3), NEAR, hold, land, platform=platform)) == [
        f"WP 2: Alt ignored on {platform.value} (+2)",
        f"WP 2: speed ignored on {platform.value} (+2)",
        f"WP 3: {platform.value} drives on while it holds",
        f"WP 4: {platform.value} disarms there",
    ]


def test_a_far_or_high_flight_is_reported_on_inav_without_limits() -> None:
    far = replace(WP, lat_e7=LAT + 60 * NORTH, alt_m=200.0)
    assert texts(NEAR, far, RTL_LANDS) == [
        "WP 2: 5.9 km leg, over 2 km (+1)",
        "WP 2: 6.0 km from home, over 5 km",
        "WP 2: 200 m high",
    ]


def test_a_leg_that_inav_would_fly_lower_rejects_the_list() -> None:
    reason = "Rejected, WP 1: nav_max_altitude is 40 m: INAV would not climb to 50 m"
    assert texts(WP, nav_max_altitude=4000) == [reason]
    assert texts(WP, nav_max_altitude=5000) == texts(WP, nav_max_altitude=4000, nav_wp_enforce_altitude=100) == []
    # Home is 123 m above the sea.
    above_sea = replace(WP, frame=0, alt_m=173.0)
    assert texts(above_sea, nav_max_altitude=4000) == [reason]
    assert texts(above_sea, nav_max_altitude=5000) == []


def test_inav_before_8_flies_above_nav_max_altitude() -> None:
    assert texts(WP, nav_max_altitude=4000, version=(7, 1, 2)) == ["WP 1: 50 m, over nav_max_altitude 40 m"]
    assert texts(WP, nav_max_altitude=5000, version=(7, 1, 2)) == []
    board, _, station = board_with(version="7.1.2")
    board._firmware._settings["nav_max_altitude"] = 5000  # type: ignore[union-attr]
    assert Upload(station, [HOME, replace(NEAR, alt_m=20.0), replace(FAR, alt_m=60.0)]).run() is ACCEPTED
    assert "WP 2: 60 m, over nav_max_altitude 50 m" in " ".join(station.texts())


def test_waypoints_within_the_radius_are_named() -> None:
    close = replace(WP, lat_e7=LAT + NORTH // 50)
    (news,) = texts(WP, close, nav_wp_radius=500)
    assert news == "WP 2: 2.0 m from the waypoint before, within nav_wp_radius (5 m): it may count as reached at once"
    assert texts(WP, close, nav_wp_radius=100) == []


@pytest.mark.parametrize(
    ("rtl", "limits", "news"),
    [
        (RTL_LANDS, {}, []),
        (RTL, {}, []),
        (
            RTL_LANDS,
            {"nav_rth_alt_mode": RthAltMode.FIXED},
            ["RTH at nav_rth_altitude 10 m, below 50 m"],
        ),
        (RTL_LANDS, {"nav_rth_alt_mode": RthAltMode.FIXED, "nav_rth_altitude": 5000}, []),
        (
            RTL_LANDS,
            {"safehomes": (Safehome(0, False, LAT, LON), Safehome(3, True, LAT + NORTH, LON))},
            ["returns to safehome 3, 100 m from home (safehome_max_distance is 200 m)"],
        ),
        (
            RTL_LANDS,
            {"safehomes": (Safehome(3, True, LAT + NORTH, LON),), "safehome_usage_mode": SafehomeUsageMode.RTH_FS},
            [],
        ),
        (RTL_LANDS, {"safehomes": (Safehome(3, True, LAT + 3 * NORTH, LON),)}, []),
    ],
)
def test_a_return_home_that_differs_from_the_list_is_named(
    rtl: MissionItem, limits: dict[str, Any], news: list[str]
) -> None:
    assert texts(WP, rtl, **limits) == [f"WP 2: {each}" for each in news]


def test_another_selected_mission_is_named() -> None:
    assert texts(WP, selected=2) == ["Stored as mission 1, mission 2 was selected"]
    first = "Stored as mission 1, mission 2 was selected"
    aeroplane: dict[str, Any] = {"platform": Platform.AEROPLANE, "selected": 2}
    renumbered = f"{first}: each mission lands by the FW approach with the new number"
    assert texts(NEAR, approach=APPROACH, **aeroplane) == [renumbered]
    assert texts(NEAR, **aeroplane) == [first]


@pytest.mark.parametrize(
    ("approach", "news"),
    [
        (None, DOWN),
        (APPROACH._replace(headings=(0, 0)), DOWN),
        (APPROACH, "lands by FW approach 8: heading 90 or 270 or 10"),
        (
            APPROACH._replace(headings=(0, 360), is_above_sea=True),
            "lands by FW approach 8: heading 0 or 180",
        ),
    ],
)
def test_how_an_aeroplane_lands_is_named(approach: FwApproach | None, news: str) -> None:
    there = replace(LAND, lat_e7=LAT + NORTH)
    assert texts(WP, there, platform=Platform.AEROPLANE, approach=approach) == [f"WP 2: {news}"]
    assert texts(WP, there, approach=approach) == []


@pytest.mark.parametrize(
    ("safehome", "limits", "news"),
    [
        (
            None,
            {},
            [DOWN],
        ),
        (
            Safehome(3, True, LAT + 3 * NORTH, LON, APPROACH._replace(number=3)),
            {},
            [DOWN],
        ),
        (
            Safehome(3, True, LAT + NORTH, LON),
            {},
            [
                "returns to safehome 3, 100 m from home (safehome_max_distance is 200 m)",
                DOWN,
            ],
        ),
        (
            Safehome(3, True, LAT + NORTH, LON, FwApproach(3)),
            {},
            [
                "returns to safehome 3, 100 m from home (safehome_max_distance is 200 m)",
                DOWN,
            ],
        ),
        (
            Safehome(3, True, LAT + NORTH, LON, APPROACH._replace(number=3)),
            {},
            [
                "returns to safehome 3, 100 m from home (safehome_max_distance is 200 m)",
                f"lands by {BY_APPROACH_3}",
            ],
        ),
        (
            Safehome(3, True, LAT + NORTH, LON, APPROACH._replace(number=3)),
            {"safehome_usage_mode": SafehomeUsageMode.OFF},
            [f"lands by {BY_APPROACH_3}"],
        ),
        (
            Safehome(3, True, LAT + NORTH, LON, FwApproach(3)),
            {"safehome_usage_mode": SafehomeUsageMode.OFF},
            [DOWN],
        ),
    ],
)
def test_how_an_aeroplane_lands_after_the_return_is_named(
    safehome: Safehome | None, limits: dict[str, Any], news: list[str]
) -> None:
    limits = {"safehomes": (safehome,) if safehome else (), **limits}
    assert texts(WP, RTL_LANDS, platform=Platform.AEROPLANE, **limits) == [f"WP 2: {each}" for each in news]
    assert not any("lands" in text and "FW" in text for text in texts(WP, RTL_LANDS, **limits))
    assert not any("FW" in text for text in texts(WP, RTL, platform=Platform.AEROPLANE, **limits))


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


def test_a_value_unknown_to_inav_is_refused() -> None:
    with pytest.raises(ValueError, match="nav_rth_alt_mode cannot be SOMETIMES"):
        saved_limits(read_settings_file(b"set nav_rth_alt_mode = SOMETIMES\n", "dump.txt"))
