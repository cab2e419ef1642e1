# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions as plain data: read back as sent, safe as JSON, and refused with a reason."""

import json
import math
from dataclasses import asdict
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from payloads.mission_data import mission_items, to_json
from protocols.mission_item import MissionItem

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
def test_a_bad_item_is_refused_by_the_name_of_its_field(entry: Any, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        mission_items([entry])
