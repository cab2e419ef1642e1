# SPDX-License-Identifier: GPL-3.0-or-later
"""Payloads of strangers: a missing or odd value is None, and nothing raises."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from fleet.payload import flag, number, part, text, whole

_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=8,
)


@given(data=st.dictionaries(st.sampled_from("abc"), _JSON), path=st.lists(st.sampled_from("abc"), min_size=1))
def test_each_value_has_its_type_or_is_unknown(data: dict[str, Any], path: list[str]) -> None:
    assert isinstance(text(data, *path), str | None)
    assert isinstance(flag(data, *path), bool | None)
    assert not isinstance(number(data, *path), bool)
    assert not isinstance(whole(data, *path), bool | float)


def test_a_value_is_found_below_its_path() -> None:
    data = {"battery": {"voltage_v": 11.1, "cells": 3}, "armed": True, "name": "kite\x1b[2J"}
    assert number(data, "battery", "voltage_v") == 11.1
    assert (whole(data, "battery", "cells"), whole(data, "battery", "voltage_v")) == (3, None)
    assert (flag(data, "armed"), number(data, "armed")) == (True, None)
    assert part(data, "armed", "x") is None
    assert "\x1b" not in (text(data, "name") or "")
