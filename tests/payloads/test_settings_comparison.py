# SPDX-License-Identifier: GPL-3.0-or-later
"""Two tables of settings side by side."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from payloads.settings_comparison import SettingRow, SettingValues, setting_values, settings_difference
from protocols.param_file import is_equal

TABLES = st.dictionaries(st.sampled_from("abcdef"), st.floats(width=32, allow_nan=False), max_size=6)


def test_changed_and_missing_settings_are_rows() -> None:
    left: SettingValues = {"a": 1.0, "b": 2.0, "c": 0.1, "name": "x"}
    right: SettingValues = {"c": 0.10000000149011612, "a": 3.0, "d": 4.0, "name": "x"}
    assert settings_difference(left, right) == [
        SettingRow("a", 1.0, 3.0), SettingRow("b", 2.0, None), SettingRow("d", None, 4.0),
    ]  # fmt: skip


def test_large_whole_numbers_differ_by_one() -> None:
    assert settings_difference({"a": 4294967295.0}, {"a": 4294967294.0})


@given(TABLES, TABLES)
def test_applying_the_difference_makes_the_tables_equal(
    left: dict[str, float | str], right: dict[str, float | str]
) -> None:
    rows = settings_difference(left, right)
    for row in rows:
        if row.right is None:
            del left[row.name]
        else:
            left[row.name] = row.right
    assert left.keys() == right.keys()
    assert all(is_equal(left[name], right[name]) for name in right)
    assert settings_difference(left, right) == []


@given(TABLES, TABLES)
def test_the_difference_is_symmetric(left: dict[str, float], right: dict[str, float]) -> None:
    there = {(row.name, row.left, row.right) for row in settings_difference(left, right)}
    back = {(row.name, row.right, row.left) for row in settings_difference(right, left)}
    assert there == back


@pytest.mark.parametrize(
    "data", [None, [], {"a": True}, {"a": math.nan}, {"a": math.inf}, {f"a{n}": n for n in range(1501)}]
)
def test_plain_data_that_is_not_a_table_is_refused(data: object) -> None:
    with pytest.raises(ValueError, match="must be"):
        setting_values(data)


def test_a_table_is_read_from_plain_data() -> None:
    assert setting_values({"a": 1, "b": 2.5, "c": "x", "nan": None}) == {"a": 1.0, "b": 2.5, "c": "x"}
