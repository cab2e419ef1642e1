# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions as plain data: read back as sent, safe as JSON, and refused with a reason."""

import json
import math
from dataclasses import asdict
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from payloads.mission_data import correction_texts, mission_findings, mission_items, to_json
from protocols.mission_item import MissionItem
from reports.finding import Finding, News

_NUMBER = st.floats(width=32, allow_infinity=False)
ITEMS = st.builds(
    MissionItem, st.integers(0, 65535), st.integers(0, 65535), st.integers(0, 255), _NUMBER, _NUMBER, _NUMBER, _NUMBER,
    st.none() | st.integers(-(2**31), 2**31 - 1), st.none() | st.integers(-(2**31), 2**31 - 1), _NUMBER,
)  # fmt: skip
POINT = asdict(MissionItem(1, 16, 3, 0, 0, 0, 0, 453838000, 84733000, 20.0))


@given(items=st.lists(ITEMS, max_size=4))
def test_items_survive_json(items: list[MissionItem]) -> None:
    read = mission_items(json.loads(to_json([asdict(item) for item in items])))
    assert repr(read) == repr([MissionItem(**asdict(item)) for item in items])


def test_infinity_is_json_too() -> None:
    assert json.loads(to_json({"a": [math.inf, math.nan]})) == {"a": ["inf", None]}


@pytest.mark.parametrize(
    ("entry", "named"),
    [(POINT | {"seq": 70000}, "seq"), (POINT | {"command": True}, "command"), (POINT | {"p1": "high"}, "p1"),
     (POINT | {"lat_e7": 45.5}, "lat_e7"), ([], "item")],
)  # fmt: skip
def test_a_bad_item_is_refused_by_the_name_of_the_field(entry: Any, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        mission_items([entry])


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda each: st.lists(each, max_size=3) | st.dictionaries(st.text(max_size=5), each, max_size=3),
)
_FIELDS = ("seq", "field", "was", "becomes", "why", "command", "news", "from_a_newer_release")


@given(data=_JSON | st.lists(st.dictionaries(st.sampled_from(_FIELDS), _JSON | st.sampled_from(["p1", "command"]))))
def test_findings_of_any_release_can_be_printed(data: object) -> None:
    """They come from other vehicles, too."""
    assert all(text.isprintable() for text in correction_texts(mission_findings(data)))


def test_findings_survive_json() -> None:
    found = [
        Finding(3, "p1", 3.5, 3, "whole numbers only", 16, News.WARNING),
        Finding(None, "list", 9, "rejected", "no"),
    ]
    assert mission_findings(json.loads(to_json([asdict(each) for each in found]))) == found
