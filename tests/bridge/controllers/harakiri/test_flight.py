# SPDX-License-Identifier: GPL-3.0-or-later
"""What Harakiri's flight core refuses in the air is said at Write: the compiled core itself confirms each verdict."""

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.controllers.harakiri.check import (
    LEAST_M,
    MAX_LEG_M,
    TAKEOFF_MOST_M,
    USUAL_FLIGHT,
    FlightLimits,
    HarakiriRules,
)
from bridge.missions.list_check import check_list
from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_item import MissionItem
from reports.finding import News
from reports.verdict import Result
from tests.support.flight_core import FlightCore
from tests.support.rule_items import HOME, LAND, LAT, LON, ROI, RTL, TAKEOFF, TIME, TURNS, WAYPOINT, item

FIRMWARE = Path(__file__).parents[4] / "firmware"
#: 100 m to the north and to the east.
NORTH, EAST = 8983, 12788


def north(hundreds: float, **fields: Any) -> MissionItem:
    return item(WAYPOINT, lat_e7=LAT + round(hundreds * NORTH), **fields)


def warnings(
    *items: MissionItem, here: tuple[int, int] | None = None, limits: FlightLimits | None = USUAL_FLIGHT
) -> list[str]:
    verdict = check_list([HOME, *items], HarakiriRules(flight=limits), here)
    assert all(len(finding.text()) <= 50 for finding in verdict.findings if finding.news is News.DANGER)
    return [finding.text() for finding in verdict.findings if finding.news is not News.NONE]


SWAPPED = replace(north(1), lat_e7=LON, lon_e7=LAT)
CASES = [
    ((north(1.9), north(3)), None, []),
    ((north(2.5),), None, ["WP 1: not flown: 250 m off, mission_first 200 m"]),
    ((north(1), north(30), north(60)), None, ["WP 2: not flown: 2.9 km leg, at most 2 km (+1)"]),
    ((north(1), north(20.9)), None, []),
    ((north(1), north(21.1)), None, ["WP 2: not flown: 2.0 km leg, at most 2 km"]),
    ((north(1), SWAPPED), None, ["WP 2: not flown: 5,779 km leg, at most 2 km"]),
    ((north(1, alt_m=101.0), north(2, alt_m=120.0)), None, ["WP 1: not flown: 101 m, mission_height 100 (+1)"]),
    ((north(1, alt_m=100.0), north(2, alt_m=-100.0)), None, ["WP 2: -100 m is flown at 2 m"]),
    ((item(TAKEOFF), north(2.5)), None, ["WP 2: not flown: 250 m off, mission_first 200 m"]),
    ((north(1), north(20), north(39), item(RTL)), None, ["WP 4: not flown: 3.9 km leg, at most 2 km"]),
    ((north(1), item(RTL, alt_m=120.0)), None, ["WP 2: not flown: 120 m, mission_height 100"]),
    ((north(1),), (LAT + 5 * NORTH, LON), ["WP 1: starts only at the list's home, 500 m off"]),
    ((north(6),), (LAT + 5 * NORTH, LON), []),
    # On a desk, 30 km away.
    ((north(1), item(RTL)), (LAT + 300 * NORTH, LON), ["flown only from the list's home, 30.0 km off"]),
    ((north(1), item(RTL)), (LAT, LON + 300 * EAST), ["flown only from the list's home, 30.0 km off"]),
]


@pytest.fixture(scope="module")
def flight_core(tmp_path_factory: pytest.TempPathFactory) -> FlightCore:
    return FlightCore(tmp_path_factory.mktemp("core"))


@pytest.mark.parametrize(("items", "here", "told"), CASES)
def test_the_core_refuses_exactly_the_reported_lists(
    flight_core: FlightCore, items: tuple[MissionItem, ...], here: tuple[int, int] | None, told: list[str]
) -> None:
    assert warnings(*items, here=here) == told
    records = check_list([HOME, *items], HarakiriRules()).records
    refused = flight_core.refusal(records, here or (LAT, LON), USUAL_FLIGHT)
    assert (refused is not None) == any("flown at" not in text for text in told), refused


steps = st.tuples(st.floats(-1500, 1500), st.floats(-1500, 1500), st.integers(-130, 130))
MIDDLE = st.sampled_from([WAYPOINT, WAYPOINT, WAYPOINT, TIME, TURNS, RTL, ROI])


@given(
    st.booleans(),
    st.lists(st.tuples(MIDDLE, steps), min_size=1, max_size=8),
    st.sampled_from([None, LAND, RTL]),
    st.sampled_from([0, 150, 1000]),
)
def test_exactly_the_refusals_of_the_core_are_reported(
    flight_core: FlightCore,
    takes_off: bool,
    legs: list[tuple[int, tuple[float, float, int]]],
    last: int | None,
    mission_radius: int,
) -> None:
    items = [item(TAKEOFF)] if takes_off else []
    north_m = east_m = 0.0
    for command, (to_north, to_east, alt_m) in legs:
        # Mostly short ways.
        north_m, east_m = north_m + to_north / (1 + abs(alt_m) % 9), east_m + to_east / (1 + abs(alt_m) % 9)
        place = {"lat_e7": LAT + round(north_m * 89.83), "lon_e7": LON + round(east_m * 127.9)}
        items.append(item(command, alt_m=float(alt_m or 1), **({} if command == RTL else place)))
    items += [item(WAYPOINT)] if last is None else [item(last)]
    limits = FlightLimits(mission_radius=mission_radius)
    verdict = check_list([HOME, *items], HarakiriRules(flight=limits))
    if verdict.result is not Result.ACCEPTED:
        return
    told = any(finding.why.startswith(("not flown", "starts only")) for finding in verdict.findings)
    refused = flight_core.refusal(verdict.records, (LAT, LON), limits)
    assert (refused is not None) == told, (refused, [finding.text() for finding in verdict.findings])


def test_the_settings_of_the_board_count() -> None:
    assert warnings(north(2.4), limits=FlightLimits(mission_first=250)) == []
    assert warnings(north(1, alt_m=60.0), limits=FlightLimits(mission_height=50)) == [
        "WP 1: not flown: 60 m, mission_height 50"
    ]
    assert warnings(north(1), north(2), limits=FlightLimits(mission_radius=150)) == [
        "WP 2: not flown: 200 m off, mission_radius 150 m"
    ]


def test_a_board_that_does_not_fly_missions_has_plain_limits() -> None:
    assert warnings(north(3), north(30), limits=None) == ["WP 2: 2.7 km leg, over 2 km"]
    assert warnings(north(3, alt_m=121.0), limits=None) == ["WP 1: 121 m high"]


@pytest.mark.parametrize(
    ("rtl_m", "told"),
    [
        (0.0, ["WP 2: RTL home at 2 m: set Alt, or a WP at home"]),
        (5.0, ["WP 2: RTL flies home at 5 m, below the 20 m"]),
        (20.0, []),
    ],
)
def test_a_return_below_the_way_out_is_reported(rtl_m: float, told: list[str]) -> None:
    assert warnings(north(1, alt_m=20.0), item(RTL, alt_m=rtl_m)) == told


def test_the_constants_are_those_of_the_firmware() -> None:
    header = (FIRMWARE / "naze_flight.h").read_text()
    defaults = (FIRMWARE / "harakiri_flight.c").read_text()
    limits = {"NF_MAX_LEG_M": MAX_LEG_M, "NF_TAKEOFF_LEAST_M": LEAST_M, "NF_TAKEOFF_MOST_M": TAKEOFF_MOST_M}
    found = {name: int(value) for name, value in re.findall(r"#define (NF_\w+_M) (\d+)", header)}
    assert {name: found[name] for name in limits} == limits
    for name in ("mission_first", "mission_height"):
        usual = re.search(rf"set_default\(&cfg\.{name}, \d+, \d+, (\d+)\)", defaults)
        assert usual is not None
        assert int(usual[1]) == getattr(USUAL_FLIGHT, name)


@pytest.mark.skipif("MISSIONS" not in os.environ, reason="NOT RUN: needs MISSIONS=folder/of/other/people's/files")
def test_every_refusal_of_a_public_mission_is_reported(flight_core: FlightCore) -> None:
    for path in sorted(Path(os.environ["MISSIONS"]).iterdir()):
        try:
            items = read_mission_file(path.read_bytes(), path.name)
        except MissionFileError:
            continue
        firsts = [(each.lat_e7, each.lon_e7 + 9_000) for each in items[1:2] if each.lat_e7 and each.lon_e7]
        for here in (None, *firsts):
            verdict = check_list(items, HarakiriRules(), here)
            if verdict.result is Result.ACCEPTED:
                told = any(
                    finding.why.startswith(("not flown", "starts only", "flown only")) for finding in verdict.findings
                )
                place = here or (verdict.records[0].lat_e7, verdict.records[0].lon_e7)
                refused = flight_core.refusal(verdict.records, place, USUAL_FLIGHT)
                assert (refused is not None) == told, (path.name, refused)
