# SPDX-License-Identifier: GPL-3.0-or-later
"""Payloads of strangers: a missing or odd value is None, and nothing raises."""

import json
from types import SimpleNamespace
from typing import Any, cast

import zenoh
from hypothesis import given
from hypothesis import strategies as st

from fleet.payload import decode, flag, number, part, text, whole

_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=8,
)


@given(data=st.dictionaries(st.sampled_from("abc"), _JSON), path=st.lists(st.sampled_from("abc"), min_size=1))
def test_each_value_has_a_type_or_is_unknown(data: dict[str, Any], path: list[str]) -> None:
    assert isinstance(text(data, *path), str | None)
    assert isinstance(flag(data, *path), bool | None)
    assert not isinstance(number(data, *path), bool)
    assert not isinstance(whole(data, *path), bool | float)


def test_a_value_is_found_below_the_path() -> None:
    data = {"battery": {"voltage_v": 11.1, "cells": 3}, "armed": True}
    assert number(data, "battery", "voltage_v") == 11.1
    assert (whole(data, "battery", "cells"), whole(data, "battery", "voltage_v")) == (3, None)
    assert (flag(data, "armed"), number(data, "armed")) == (True, None)
    assert part(data, "armed", "x") is None


class _Payload:
    """Stands for zenoh.ZBytes, which only zenoh can make."""

    def __init__(self, data: bytes) -> None:
        self.to_bytes = lambda: data


def test_every_text_in_a_payload_is_safe_to_print() -> None:
    body = json.dumps({"values": {"a\x1b[2J": "b\x1b]8;;http://e\x07"}, "list": ["\u202e"]}).encode()
    sample = SimpleNamespace(payload=_Payload(body), encoding="application/json")
    assert decode(cast("zenoh.Sample", sample)) == {"values": {"a[2J": "b]8;;http://e"}, "list": [""]}
