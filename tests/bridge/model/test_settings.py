# SPDX-License-Identifier: GPL-3.0-or-later

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.fc.fc_settings import out_of_range
from bridge.model.settings import BoardSetting, SettingsChange, Value, ValueKind, shown, table_of
from bridge.voice.sentences import settings_changed


@given(count=st.integers(1, 40))
def test_a_long_report_is_cut_between_names_and_gives_the_number_left_out(count: int) -> None:
    names = tuple(f"name_{at}" for at in range(count))
    line = settings_changed(names).line
    assert len(line) <= 50
    named, _, more = line.partition("+")
    assert named.count("name_") + int(more or 0) == count
    assert SettingsChange(names, 0.0).text.count("name_") == count


P_ROLL = BoardSetting("p_roll", ValueKind.INTEGER, 1, 200, 35)
LAG = BoardSetting("bar_lag", ValueKind.FLOAT, 0, 10, 0.30000001192092896, "s")
NAME = BoardSetting("name", ValueKind.TEXT, 0, 16, "INAV")


@pytest.mark.parametrize(
    ("setting", "value", "is_accepted"),
    [
        (P_ROLL, 1, True), (P_ROLL, 200, True), (P_ROLL, 200.0, True), (P_ROLL, 0, False), (P_ROLL, 201, False),
        (P_ROLL, 1.5, False), (P_ROLL, nan, False), (P_ROLL, inf, False), (P_ROLL, "40", False),
        (LAG, 1.5, True), (LAG, -0.1, False), (LAG, nan, False),
        (NAME, "", True), (NAME, "x" * 16, True), (NAME, "x" * 17, False), (NAME, "a\nb", False), (NAME, "é", False),
        (NAME, 5, False),
    ],
)  # fmt: skip
def test_only_values_of_the_kind_and_range_are_accepted(setting: BoardSetting, value: Value, is_accepted: bool) -> None:
    assert setting.accepts(value) is is_accepted


@pytest.mark.parametrize(
    ("setting", "value", "sentence"),
    [
        (P_ROLL, 300, "p_roll stays 35: 1..200"),
        (P_ROLL, 1.5, "p_roll stays 35: a whole number, 1..200"),
        (LAG, 11, "bar_lag stays 0.3: 0..10 s"),
        (NAME, "x" * 20, "name stays INAV: 0 to 16 characters"),
    ],
)
def test_a_refusal_names_the_range(setting: BoardSetting, value: Value, sentence: str) -> None:
    assert out_of_range(setting, value).text == sentence


def test_a_table_finds_names_in_any_case_unless_two_differ_only_in_it() -> None:
    table = table_of(P_ROLL, LAG, BoardSetting("P_ROLL", ValueKind.INTEGER, 0, 1, 0))
    assert table.find("P_ROLL") is table.settings["P_ROLL"]
    assert table.find("BAR_LAG") is LAG
    assert table.find("P_Roll") is None


@pytest.mark.parametrize("name", ["", "a\x1b[2J", "a\nb", "a b", "a,b", "#a", "\xe9", "x" * 65])
def test_settings_with_impossible_names_are_left_out(name: str) -> None:
    table = table_of(P_ROLL, BoardSetting(name, ValueKind.INTEGER, 0, 1, 0), LAG)
    assert (list(table), table.is_complete) == ([P_ROLL, LAG], True)


@pytest.mark.parametrize(
    ("value", "text"), [(35, "35"), (35.0, "35"), (0.30000001192092896, "0.3"), (2147483647, "2147483647"), ("x", "x")]
)
def test_values_are_shown_as_typed(value: Value, text: str) -> None:
    assert shown(value) == text
