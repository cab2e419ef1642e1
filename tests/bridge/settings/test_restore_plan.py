# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a restore: what it would write, what it cannot write, and why."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.fc.fc_settings import SettingRefusal
from bridge.model.board_setting import BoardSetting, SettingTable, Value, ValueKind, table_of
from bridge.settings.restore_plan import LeftOut, PlannedChange, RestorePlan, plan_restore
from protocols.param_file import MOST_SETTINGS, is_equal
from tests.support.work import LOOP_BUDGET, work

INTEGER, FLOAT, TEXT = ValueKind.INTEGER, ValueKind.FLOAT, ValueKind.TEXT
TABLE = table_of(
    BoardSetting("p_roll", INTEGER, 0, 200, 35),
    BoardSetting("cf", FLOAT, 0, 1, 0.10000000149011612),
    BoardSetting("name", TEXT, 0, 8, "kite"),
    BoardSetting("gbl_flg", INTEGER, 0, 255, 1, fixed="it can crash"),
    BoardSetting("esc_moff", INTEGER, 0, 2000, 1000, raised="motors"),
)
BOARD = "Harakiri 2.1.1"
NAMES = [setting.name for setting in TABLE]
VALUES = st.integers(-5, 300).map(float) | st.floats(-1, 2, width=32) | st.text("ab", max_size=10)


def plan(wanted: dict[str, Value], source: str = BOARD, table: SettingTable = TABLE) -> RestorePlan:
    found = plan_restore(wanted, source, table, BOARD)
    assert isinstance(found, RestorePlan), found
    return found


def test_only_what_differs_is_written() -> None:
    found = plan({"p_roll": 40.0, "cf": 0.1, "name": "kite"})
    assert found.changes == (PlannedChange("p_roll", 35, 40.0),)
    assert (found.left_out, found.notice) == ((), "")


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("p_roll", 201.0, "it must be 0..200"),
        ("p_roll", 40.5, "it must be 0..200"),
        ("p_roll", "40", "it must be 0..200"),
        ("name", "too long a name", "it must be 0 to 8 characters"),
        ("gbl_flg", 2.0, "it can crash"),
        ("esc_moff", 1001.0, "motors"),
    ],
)
def test_a_setting_that_cannot_be_written_is_left_out_with_the_reason(name: str, value: Value, why: str) -> None:
    found = plan({name: value})
    assert found.changes == ()
    assert found.left_out == (LeftOut(name, value, TABLE.settings[name].value, why),)


def test_a_setting_that_can_only_be_lowered_is_lowered() -> None:
    assert plan({"esc_moff": 999.0}).changes == (PlannedChange("esc_moff", 1000, 999.0),)


def test_a_name_that_the_board_lacks_is_left_out() -> None:
    found = plan({"p_roll": 35.0, "SYSID_THISMAV": 1.0})
    assert found.left_out == (LeftOut("SYSID_THISMAV", 1.0, None, "the board has no such setting"),)


def test_a_text_that_looks_like_a_number_is_restored_as_a_text() -> None:
    assert plan({"name": 5.0}).changes == (PlannedChange("name", "kite", "5"),)


def test_settings_of_another_firmware_are_refused() -> None:
    refusal = plan_restore({"p_roll": 40.0}, "INAV 8.0.1", TABLE, BOARD)
    assert isinstance(refusal, SettingRefusal)
    assert refusal.text == "These settings are from INAV 8.0.1, but the board has Harakiri 2.1.1"


def test_settings_of_another_version_carry_a_notice() -> None:
    found = plan({"p_roll": 40.0}, "Harakiri 2.0.0")
    assert found.changes
    assert "Harakiri 2.0.0" in found.notice
    assert plan({"p_roll": 40.0}, "").notice == ""


def test_a_file_without_any_setting_of_the_board_is_refused() -> None:
    assert isinstance(plan_restore({"WPNAV_SPEED": 5.0}, "", TABLE, BOARD), SettingRefusal)


@given(st.dictionaries(st.sampled_from([*NAMES, "other"]), VALUES, min_size=1))
def test_every_setting_is_written_left_out_or_equal(wanted: dict[str, Value]) -> None:
    found = plan_restore(wanted, BOARD, TABLE, BOARD)
    if isinstance(found, SettingRefusal):
        assert wanted.keys() == {"other"}
        return
    listed = {each.name for each in found.changes} | {each.name for each in found.left_out}
    assert all(is_equal(TABLE.settings[name].value, wanted[name]) for name in wanted.keys() - listed)
    for change in found.changes:
        setting = TABLE.settings[change.name]
        assert setting.accepts(change.becomes)
        assert not setting.fixed
        assert not is_equal(setting.value, change.becomes)


def test_the_longest_file_is_compared_with_the_largest_board_within_the_loops_budget() -> None:
    table = table_of(*(BoardSetting(f"nav_setting_{n}", INTEGER, 0, 200, 35) for n in range(1000)))
    wanted: dict[str, Value] = {f"NAV_SETTING_{n}": 5.0 for n in range(MOST_SETTINGS)}
    assert work(lambda: plan(wanted, table=table)) < LOOP_BUDGET
