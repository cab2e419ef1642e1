# SPDX-License-Identifier: GPL-3.0-or-later
"""A restore sets, saves and verifies, on every kind of board; whatever fails before the save loses nothing."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.model.settings import BoardSetting, SettingTable, Value, ValueKind, table_of
from bridge.settings.local_settings import (
    LeftOut,
    PlannedChange,
    RestorePlan,
    RestoreResult,
    by_parameter,
    by_setting,
    plan_restore,
)
from protocols.param_file import is_equal
from simulator.board.options import Faults
from tests.support.settings_client import BOARDS, ready, restart, value_of
from tests.support.work import LOOP_BUDGET, work
from tests.support.world import World

EEPROM_WRITE, SET_SETTING = 250, 198
#: Three settings of a board with other values.
CHANGES: dict[str, dict[str, Value]] = {
    "patched Harakiri": {"p_roll": 44.0, "i_roll": 33.0, "snr_cf": 0.25},
    "INAV": {"nav_rth_altitude": 1300.0, "mc_p_roll": 44.0, "mc_p_pitch": 45.0},
    "MultiWii": {"PITCH_P": 40.0, "ROLL_P": 41.0, "YAW_P": 42.0},
    "Betaflight": {"PITCH_D": 35.0, "ROLL_D": 36.0, "YAW_P": 37.0},
}
NAZE = "patched Harakiri"


def restored(
    world: World, wanted: dict[str, Value], source: str = "", at_progress: Callable[[int], None] = lambda _count: None
) -> RestoreResult | SettingRefusal:
    found: list[RestoreResult | SettingRefusal] = []
    world.bridge.settings.restore(
        wanted, source, "test", at_progress, lambda result, _at: found.append(result), world.now
    )
    world.wait_until(lambda _: bool(found), 90)
    (result,) = found
    return result


def outcome(result: RestoreResult | SettingRefusal) -> RestoreResult:
    assert isinstance(result, RestoreResult), result
    return result


def values(table: SettingTable | SettingRefusal) -> dict[str, Value]:
    assert isinstance(table, SettingTable), table
    return {setting.name: setting.value for setting in table}


def writes(world: World) -> int:
    """Saves and changes that were sent to the board."""
    return sum(frame.command in (EEPROM_WRITE, SET_SETTING) for frame in world.requests())


@pytest.mark.parametrize("name", CHANGES)
def test_a_backup_is_restored_saved_and_verified(name: str) -> None:
    world, client = ready(BOARDS[name])
    world.wait_until(lambda world: bool(world.backups), 20)
    (backup,) = world.backups
    before = values(client.wait_read())
    assert backup.values == before
    for setting, value in CHANGES[name].items():
        value_of(client.change(setting, value))
    assert client.save() is None
    result = outcome(restored(world, dict(backup.values), backup.board.kind))
    assert (result.is_saved, result.text) == (True, "3 settings restored, saved and verified")
    assert {*result.changed} == CHANGES[name].keys()
    restart(world)
    assert values(client.current()) == before
    world.run(5)
    assert [each.occasion.value for each in world.backups][:3] == ["connected", "saved", "saved"]
    assert world.backups[-1].values == before


def test_equal_settings_are_not_written() -> None:
    world, client = ready(BOARDS[NAZE])
    before = writes(world)
    result = outcome(restored(world, values(client.wait_read())))
    assert (result.is_saved, result.text) == (True, "Nothing to restore")
    assert writes(world) == before


def test_a_value_that_only_the_board_refuses_is_left_out() -> None:
    world, client = ready(BOARDS[NAZE])
    result = outcome(restored(world, {"p_roll": 44.0, "esc_moff": 1100.0, "i_roll": 33.0}))
    assert (result.is_saved, result.changed) == (True, ("p_roll", "i_roll"))
    assert [each.name for each in result.left_out] == ["esc_moff"]
    assert "it can only be lowered" in result.left_out[0].why
    assert client.value("esc_moff") == 1000
    alone = outcome(restored(world, {"esc_moff": 1100.0}))
    assert (alone.is_saved, alone.text) == (False, "Nothing written: 1 setting cannot be set")


@pytest.mark.parametrize("name", CHANGES)
@pytest.mark.parametrize("fault", ["arms", "cable"])
def test_a_fault_prevents_the_save_and_names_the_changes(name: str, fault: str) -> None:
    faults = Faults()
    world, client = ready(BOARDS[name], faults)
    before = values(client.wait_read())

    def progress(count: int) -> None:
        if count == 2 and fault == "arms":
            faults.armed = True
        elif count == 2:
            world.after(0.0, world.unplug)

    result = outcome(restored(world, CHANGES[name], "", progress))
    assert not result.is_saved
    first, second, _ = CHANGES[name]
    assert result.changed == (first, second)
    assert result.text.startswith("Nothing saved: ")
    assert f"2 of 3 settings were changed in the board's memory ({first}, {second})" in result.text
    assert result.text.endswith("to return to the saved settings, switch the board off and on")
    faults.armed = False
    if fault == "cable":
        world.plug()
    restart(world)
    world.wait_until(lambda world: world.bridge.vehicle.armed is False, 20)
    assert values(client.current()) == before


def test_pulling_the_cable_during_the_save_leaves_the_outcome_open() -> None:
    world, _ = ready(BOARDS[NAZE])
    result = outcome(restored(world, {"p_roll": 44.0}, "", lambda _count: world.after(0.03, world.unplug)))
    assert not result.is_saved
    assert result.text.startswith(("Perhaps not saved: ", "Nothing saved: "))


def test_an_armed_board_is_not_restored() -> None:
    faults = Faults()
    world, _ = ready(BOARDS[NAZE], faults)
    world.arm(20)
    before = writes(world)
    result = restored(world, {"p_roll": 44.0})
    assert isinstance(result, SettingRefusal)
    assert result.cause is Cause.ARMED
    assert writes(world) == before


@pytest.mark.parametrize("name", ["patched Harakiri", "INAV"])
def test_a_file_with_the_names_of_parameters_is_restored(name: str) -> None:
    world, client = ready(BOARDS[name])
    held = values(client.wait_read())
    file = by_parameter(held)
    assert len(file) == len(held)
    assert max(map(len, file)) <= 16
    assert by_setting(file, held) == held
    assert outcome(restored(world, file)).text == "Nothing to restore"
    long = next(each for each in client.wait_read() if len(each.name) > 16 and not each.fixed and each.value == 0)
    (parameter,) = by_parameter({long.name: 0.0})
    assert outcome(restored(world, {parameter: 1.0})).changed == (long.name,)


def test_one_restore_runs_at_a_time() -> None:
    world, _ = ready(BOARDS[NAZE])
    second: list[RestoreResult | SettingRefusal] = []

    def progress(_count: int) -> None:
        world.bridge.settings.restore(
            {"p_roll": 50.0}, "", "other", lambda _count: None, lambda result, _at: second.append(result), world.now
        )

    assert outcome(restored(world, {"p_roll": 44.0}, "", progress)).is_saved
    (refused,) = second
    assert isinstance(refused, SettingRefusal)
    assert outcome(restored(world, {"p_roll": 50.0})).is_saved


def test_after_a_fault_a_restore_can_begin() -> None:
    world, _ = ready(BOARDS[NAZE])
    ended: list[object] = []
    world.bridge.settings.restore({"p_roll": 44.0}, "", "client", lambda _: None, lambda *_: ended.append(1), world.now)
    world.bridge.restart("internal error", world.now)
    world.wait_ready(30)
    assert outcome(restored(world, {"p_roll": 50.0})).is_saved


def test_another_clients_change_prevents_the_save() -> None:
    world, _ = ready(BOARDS[NAZE])

    def progress(count: int) -> None:
        if count == 1:
            world.bridge.settings.change("p_roll", 99, lambda _result, _at: None, world.now, "another")

    result = outcome(restored(world, {"p_roll": 44.0, "i_roll": 33.0}, "", progress))
    assert not result.is_saved
    assert "p_roll has another value" in result.text


def planned(world: World) -> object:
    """A plan from memory."""
    found: list[object] = []
    world.bridge.settings.plan({"p_roll": 44.0}, "", lambda plan, _at: found.append(plan), world.now, is_checked=False)
    (plan,) = found
    return plan


def test_the_plan_from_memory_does_not_ask_the_board() -> None:
    world, client = ready(BOARDS[NAZE])
    client.wait_read()
    before = len(world.written)
    assert isinstance(planned(world), RestorePlan)
    assert len(world.written) == before


def test_a_plan_needs_a_board() -> None:
    world = World(powered=False)
    assert isinstance(planned(world), SettingRefusal)
    assert isinstance(restored(world, {"p_roll": 44.0}), SettingRefusal)


INTEGER, FLOAT, TEXT = ValueKind.INTEGER, ValueKind.FLOAT, ValueKind.TEXT
TABLE = table_of(
    BoardSetting("p_roll", INTEGER, 0, 200, 35),
    BoardSetting("cf", FLOAT, 0, 1, 0.10000000149011612),
    BoardSetting("name", TEXT, 0, 8, "kite"),
    BoardSetting("gbl_flg", INTEGER, 0, 255, 1, fixed="it can crash"),
    BoardSetting("esc_moff", INTEGER, 0, 2000, 1000, raised="motors"),
    BoardSetting("mode", INTEGER, 0, 1, 0, choices=("AUTO", "115200")),
)
BOARD = "Harakiri 2.1.1"
NAMES = [setting.name for setting in TABLE]
VALUES = st.integers(-5, 300).map(float) | st.floats(-1, 2, width=32) | st.text("ab", max_size=10)


def plan(wanted: dict[str, Value], source: str = BOARD, table: SettingTable = TABLE) -> RestorePlan:
    found = plan_restore(wanted, source, table, BOARD)
    assert isinstance(found, RestorePlan), found
    return found


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("p_roll", 201.0, "it must be 0..200"),
        ("p_roll", 40.5, "it must be 0..200"),
        ("p_roll", "high", "it must be 0..200"),
        ("p_roll", 1e39, "it must be 0..200"),
        ("mode", "NEVER", "it is one of AUTO, 115200"),
        ("name", "too long a name", "it must be 0 to 8 characters"),
        ("gbl_flg", 2.0, "it can crash"),
        ("esc_moff", 1001.0, "motors"),
    ],
)
def test_a_setting_that_cannot_be_written_is_left_out_with_the_reason(name: str, value: Value, why: str) -> None:
    found = plan({name: value})
    assert found.changes == ()
    assert found.left_out == (LeftOut(name, value, TABLE.settings[name].value, why),)


@pytest.mark.parametrize(
    ("wanted", "changes"),
    [
        # The texts of a dump.
        ({"p_roll": "40", "cf": "0.100"}, [PlannedChange("p_roll", 35, 40.0)]),
        ({"mode": "115200"}, [PlannedChange("mode", 0, 1)]),
        ({"esc_moff": 999.0}, [PlannedChange("esc_moff", 1000, 999.0)]),
        ({"name": 5.0}, [PlannedChange("name", "kite", "5")]),
    ],
)
def test_values_are_written_as_the_settings_kind(wanted: dict[str, Value], changes: list[PlannedChange]) -> None:
    assert [*plan(wanted).changes] == changes


def test_the_pids_of_a_betaflight_dump() -> None:
    known = ("ROLL_P", "ROLL_I", "MIN_THROTTLE", "x")
    given: dict[str, Value] = {"p_roll": "44", "min_throttle": "1070", "d_roll": "20", "x": "1"}
    assert by_setting(given, known) == {"ROLL_P": "44", "MIN_THROTTLE": "1070", "d_roll": "20", "x": "1"}


def test_settings_of_another_firmware_or_of_no_setting_are_refused() -> None:
    refusal = plan_restore({"p_roll": 40.0}, "INAV 8.0.1", TABLE, BOARD)
    assert isinstance(refusal, SettingRefusal)
    assert refusal.text == "These settings are from INAV 8.0.1, but the board has Harakiri 2.1.1"
    assert isinstance(plan_restore({"WPNAV_SPEED": 5.0}, "", TABLE, BOARD), SettingRefusal)


def test_settings_of_another_version_carry_a_notice() -> None:
    found = plan({"p_roll": 40.0}, "Harakiri 2.0.0")
    assert found.changes
    assert "Harakiri 2.0.0" in found.notice
    for unknown in ("", "  "):
        assert plan({"p_roll": 40.0}, unknown).notice == ""


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
    wanted: dict[str, Value] = {f"NAV_SETTING_{n}": 5.0 for n in range(1500)}
    assert work(lambda: plan(by_setting(wanted, table.settings), table=table)) < LOOP_BUDGET
