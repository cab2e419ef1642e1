# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl plans: accepted files, and refusals with their messages."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.mission_file import MissionFileError, read_mission_file, write_mission_file
from protocols.mission_item import MissionItem


def simple(command: Any = 16, frame: Any = 3, params: Any = None, **extra: Any) -> dict[str, Any]:
    if params is None:
        params = [0, 3, 0, None, 45.3840141, 8.4741389, 13]
    return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": frame, "params": params} | extra


def plan(*items: Any, home: Any = (45.3838, 8.4733, 131), **mission: Any) -> dict[str, Any]:
    return {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": [], "version": 2},
        "mission": {"version": 2, "items": list(items), "plannedHomePosition": home} | mission,
    }


def read(document: Any) -> list[MissionItem]:
    return read_mission_file(json.dumps(document, indent=1).encode(), "field.plan")


def error(document: Any) -> str:
    with pytest.raises(MissionFileError) as caught:
        read(document)
    text = str(caught.value)
    assert text.startswith("field.plan")
    assert text.isprintable()
    assert "; " in text
    return text


def refusal(document: Any) -> str | None:
    try:
        read(document)
    except MissionFileError as error:
        return str(error)
    return None


def test_home_is_item_0_and_null_is_not_given() -> None:
    home, point = read(plan(simple(AltitudeMode=1, Altitude=13)))
    assert home == MissionItem(0, 16, 0, 0.0, 0.0, 0.0, 0.0, 453838000, 84733000, 131.0)
    assert (point.seq, point.command, point.frame, point.p2, point.alt_m) == (1, 16, 3, 3.0, 13.0)
    assert (point.lat_e7, point.lon_e7) == (453840141, 84741389)
    assert math.isnan(point.p4)


def test_an_item_without_a_position_is_read() -> None:
    item = read(plan(simple(178, 2, [1, 4, -1, 0, None, None, None])))[1]
    assert (item.command, item.frame, item.lat_e7, item.lon_e7) == (178, 2, None, None)
    assert math.isnan(item.alt_m)


@pytest.mark.parametrize(
    ("home", "lat_e7", "lon_e7", "alt_m"),
    [
        ([1, 2, None], 10**7, 2 * 10**7, 0.0),
        ([1, 2], 10**7, 2 * 10**7, 0.0),
        ([None, None, None], None, None, 0.0),
        ([], None, None, 0.0),
        (None, None, None, 0.0),
    ],
)
def test_missing_parts_of_home_are_left_to_the_rules(
    home: Any, lat_e7: int | None, lon_e7: int | None, alt_m: float
) -> None:
    item = read(plan(simple(), home=home))[0]
    assert (item.lat_e7, item.lon_e7, item.alt_m) == (lat_e7, lon_e7, alt_m)


def test_mission_planners_own_json_is_read() -> None:
    """Its .mission has no fileType, other versions, and an item's position outside its params."""
    point = {"command": 16, "coordinate": [45.3840141, 8.4741389, 13], "frame": 3, "params": [0, 3, 0, 0]}
    document = {
        "groundStation": "MissionPlanner",
        "version": 1,
        "mission": {"items": [point], "plannedHomePosition": [45.3838, 8.4733, 131], "version": 0},
    }
    notes: list[str] = []
    home, item = read_mission_file(json.dumps(document).encode(), "field.mission", notes.append)
    assert (home.lat_e7, home.alt_m) == (453838000, 131.0)
    assert (item.command, item.frame, item.p2, item.lat_e7, item.alt_m) == (16, 3, 3.0, 453840141, 13.0)
    assert notes == ["read as Mission Planner's own JSON: it has no fileType"]


@pytest.mark.parametrize(
    ("part", "notes"),
    [
        ({"geoFence": {"polygons": [{"polygon": [[1, 2]]}]}}, ["the plan also contains a fence: ignored"]),
        ({"rallyPoints": {"points": [[1, 2, 3]]}}, ["the plan also contains rally points: ignored"]),
        ({}, []),
    ],
)
def test_an_ignored_fence_is_noted(part: dict[str, Any], notes: list[str]) -> None:
    noted: list[str] = []
    document = plan(simple()) | part
    assert len(read_mission_file(json.dumps(document).encode(), "field.plan", noted.append)) == 2
    assert noted == notes


def test_a_survey_becomes_flyable_items() -> None:
    survey = {
        "type": "ComplexItem",
        "complexItemType": "survey",
        "TransectStyleComplexItem": {"Items": [simple(), simple(206, 2, [25, 0, 1, 0, 0, 0, 0]), simple()]},
    }
    items = read(plan(simple(22), survey, simple(20, 2)))
    assert [item.command for item in items] == [16, 22, 16, 206, 16, 20]
    assert [item.seq for item in items] == list(range(6))


def test_a_plan_is_recognised_by_the_contents() -> None:
    assert len(read_mission_file(b"\xef\xbb\xbf\n " + json.dumps(plan(simple())).encode(), "mission.txt")) == 2


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"fileType": "Parameters"}, ["fileType"]),
        ({"fileType": "Plan"}, ["mission.items"]),
        ({"fileType": "Plan", "mission": []}, ["mission.items"]),
        (plan(items={}), ["mission.items"]),
        (plan(3), ["item 1", "SimpleItem"]),
        (plan(simple(), simple(type="Loop")), ["item 2", "SimpleItem"]),
        (
            plan({"type": "ComplexItem", "complexItemType": "fwLandingPattern"}),
            ["item 1", "fwLandingPattern", "waypoints"],
        ),
        (plan({"type": "ComplexItem", "TransectStyleComplexItem": {"Items": [1]}}), ["item 1"]),
        (plan(simple(params=[0] * 6)), ["item 1", "7 params"]),
        (plan(simple(params={"1": 2})), ["item 1", "7 params"]),
        (plan(simple(params=[0, 0, 0, 0, "45", 8, 1])), ["item 1", "'45'"]),
        (plan(simple(params=[0, 0, 0, True, 45, 8, 1])), ["item 1", "True"]),
        (plan(simple(params=[[], 0, 0, 0, 45, 8, 1])), ["item 1", "a list"]),
        (plan(simple(params=[10**400, 0, 0, 0, 45, 8, 1])), ["item 1", "1000"]),
        (plan(simple(command="16")), ["item 1", "command", "'16'"]),
        (plan(simple(command=-1)), ["item 1", "command", "65535"]),
        (plan(simple(frame=3.5)), ["item 1", "frame", "3.5"]),
        (plan(simple(frame=None)), ["item 1", "frame"]),
        (plan(simple(params=[0, 0, 0, 0, math.inf, 8, 1])), ["item 1", "params[4], the latitude, is inf"]),
        (plan(simple(params=[0, 0, 0, 0, 45, -1e305, 1])), ["item 1", "params[5], the longitude, is -1e+305"]),
        (plan(home=[math.inf, 2, 3]), ["plannedHomePosition", "latitude is inf"]),
        (plan(home="here"), ["plannedHomePosition", "'here'"]),
        (plan(home=[1, "2", 3]), ["plannedHomePosition", "'2'"]),
        (plan(home=[1, 2, 3, 4]), ["plannedHomePosition"]),
        ({"version": "1.0", "items": []}, ["version '1.0'", "open it in QGroundControl and save it as .plan"]),
        (plan(simple()) | {"version": 2}, ["the plan has version 2", "only 1 can be read"]),
        (plan(simple(), version=3), ["its mission has version 3"]),
        (plan() | {"geoFence": {"polygons": [{"polygon": [[1, 2]]}]}}, ["contains a fence but not a mission"]),
        (plan() | {"rallyPoints": {"points": [[1, 2, 3]]}}, ["contains rally points but not a mission"]),
        (plan(simple(5001)), ["contains a fence"]),
    ],
)
def test_a_damaged_plan_is_refused_with_the_position_of_the_error(document: Any, words: list[str]) -> None:
    text = error(document)
    for word in words:
        assert word in text


@pytest.mark.parametrize(
    "data", [b"", b"{", b'{"fileType":\n "Plan",\n "mission": {"items": [', b"\xff\xfe{", b"{}" * 9]
)
def test_a_plan_that_is_not_json_is_refused(data: bytes) -> None:
    with pytest.raises(MissionFileError, match=r"^field\.plan"):
        read_mission_file(data, "field.plan")


def test_a_truncated_plan_is_refused_with_the_line() -> None:
    whole = json.dumps(plan(simple(), simple()), indent=1).encode()
    for length in range(1, len(whole)):
        with pytest.raises(MissionFileError, match=r"line \d+: not valid JSON"):
            read_mission_file(whole[:length], "field.plan")


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=7) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=10,
)


@given(
    items=st.lists(
        st.builds(simple, command=json_values, frame=json_values, params=json_values) | json_values, max_size=2
    )
)
def test_any_json_is_read_or_refused(items: list[Any]) -> None:
    refused = refusal(plan(*items))
    assert refused is None or refused.isprintable()


@given(st.lists(st.none() | st.floats() | st.integers(), min_size=7, max_size=7), json_values)
def test_any_seven_numbers_make_an_item(params: list[float | None], home: Any) -> None:
    refused = refusal(plan(simple(params=params), home=home))
    beyond = any(value is not None and math.isinf(value * 1e7) for value in params[4:6])
    assert refused is None or "plannedHomePosition" in refused or (beyond and "item 1" in refused)


def test_a_written_plan_reads_back() -> None:
    items = read_mission_file((Path(__file__).parents[3] / "examples/naze-field.waypoints").read_bytes(), "x")
    home, *rest = read_mission_file(write_mission_file(items, "field.plan").encode(), "field.plan")
    assert (home.lat_e7, home.lon_e7, home.alt_m) == (items[0].lat_e7, items[0].lon_e7, items[0].alt_m)
    assert rest == items[1:]
