# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of every kind of board: read as a whole, changed one by one and read back, saved; never armed."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.model.settings import Value, shown
from bridge.settings.setting_work import Answer
from protocols.msp.setting_table import SettingCommand
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from tests.support.inside import inside
from tests.support.settings_client import BOARDS, SettingsClient, asked, cause_of, ready, restart, value_of
from tests.support.world import GroundStation, World

SET_PID, EEPROM_WRITE = 202, 250
#: Longer than the interval between two readings of the seal.
ROUND_S = 75.0


@pytest.mark.parametrize("name", BOARDS)
def test_settings_are_read_and_a_change_survives_only_a_save(name: str) -> None:
    board = BOARDS[name]
    world, client = ready(board)
    table = client.wait_read()
    assert (len(table), table.is_complete, client.value(board.name)) == (board.count, True, board.before)
    assert value_of(client.change(board.name, board.after)) == board.after
    restart(world)
    assert client.value(board.name) == board.before
    assert value_of(client.change(board.name, board.after)) == board.after
    assert client.save() is None
    assert not inside(world.bridge).board_settings.known.unsaved
    if name != "Harakiri":  # its simulator keeps its PIDs only as long as it is powered
        restart(world)
        assert client.value(board.name) == board.after


@pytest.mark.parametrize("name", BOARDS)
def test_a_value_out_of_range_is_refused_with_the_range_and_without_a_request(name: str) -> None:
    board = BOARDS[name]
    world, client = ready(board)
    before = len(world.written)
    result = client.change(board.name, board.outside)
    assert cause_of(result) is Cause.OUT_OF_RANGE
    setting = client.wait_read().settings[board.name]
    assert isinstance(result, SettingRefusal)
    assert result.text.startswith(f"{board.name} stays {shown(board.before)}: {shown(setting.minimum)}..")
    assert len(world.written) == before


@pytest.mark.parametrize("name", BOARDS)
def test_settings_cannot_be_changed_or_saved_while_armed(name: str) -> None:
    board = BOARDS[name]
    faults = Faults()
    world, client = ready(board, faults)
    table = client.wait_read()
    world.arm(20)
    before = world.now
    assert cause_of(client.change(board.name, board.after)) is Cause.ARMED
    assert cause_of(client.save()) is Cause.ARMED
    assert client.current() is table
    world.run(10)
    sent = {frame.command for frame in world.requests(before)}
    assert not {196, 197, 198, 202, 203, 204, 207, 250, 0x1004} & sent


@pytest.mark.parametrize("name", BOARDS)
def test_a_board_that_armed_unnoticed_is_asked_right_before_the_change(name: str) -> None:
    """It arms after the last poll: nothing that changes or saves settings follows."""
    board = BOARDS[name]
    faults = Faults()
    world, client = ready(board, faults)
    world.run(0.4)
    inside(world.bridge).session.vehicle.news.clear()
    faults.armed = True
    world.naze.advance(world.now + 0.05)
    before = world.now
    result = client.change(board.name, board.after)
    assert cause_of(result) in (Cause.ARMED, Cause.NO_ANSWER)
    assert asked(world, SettingCommand.SET_SETTING, before) == asked(world, SET_PID, before) == 0


@pytest.mark.parametrize("kind", [None, "inav"])
def test_telemetry_keeps_four_fifths_of_the_rate_while_the_list_is_read(kind: str | None) -> None:
    """At the rates that Mission Planner asks for."""
    world = World(speeds=(115200,), peer=None if kind is None else make_board(kind))
    world.wait_until(lambda world: world.is_found, 40)
    station = GroundStation(world).stay_connected()
    for stream, rate_hz in ((2, 2), (6, 2), (10, 10), (11, 4), (12, 4), (1, 2), (3, 2)):
        station.send(messages.MAVLink_request_data_stream_message(1, 1, stream, rate_hz, 1))
    settings = inside(world.bridge).board_settings
    client = SettingsClient(world)
    client.wait_read()
    world.run(5)

    def attitudes_per_s(seconds: float) -> float:
        station.take()
        before = asked(world, 108)
        world.run(seconds)
        return (asked(world, 108) - before) / seconds

    usual = attitudes_per_s(10)
    settings.known.table = None
    settings.found(inside(world.bridge).session.state.controller, world.now)
    world.run(0.25)
    assert not client.is_idle
    beside = attitudes_per_s(1.0)
    assert beside >= 0.8 * usual


@pytest.mark.parametrize(
    ("board", "name", "value"),
    [
        ("patched Harakiri", "gbl_flg", 3), ("patched Harakiri", "align_mag_x", 1),
        ("patched Harakiri", "esc_moff", 1001), ("patched Harakiri", "BOX_ARM", 1),
        ("INAV", "min_command", 1001), ("INAV", "3d_neutral", 1500), ("INAV", "MODE_ARM", ""),
        ("MultiWii", "MIN_COMMAND", 1000), ("MultiWii", "BOX_ARM", 0), ("Betaflight", "MODE_ARM", "AUX1 900-2100"),
        ("baseflight", "MIN_COMMAND", 1400),
    ],
)  # fmt: skip
def test_settings_that_could_arm_spin_or_crash_are_refused(board: str, name: str, value: Value) -> None:
    world, client = ready(BOARDS[board])
    before = client.value(name)
    result = client.change(name, value)
    assert cause_of(result) is Cause.FIXED
    assert isinstance(result, SettingRefusal)
    assert result.text.startswith(f"{name} stays {shown(before)}: ")
    world.run(2)
    assert SettingsClient(world).current()
    assert client.value(name) == before


def test_changes_are_refused_while_a_mission_arrives() -> None:
    world, client = ready(BOARDS["patched Harakiri"])
    station = GroundStation(world)
    station.send(messages.MAVLink_mission_count_message(1, 1, 5, 0), wait_s=0.1)
    assert cause_of(client.change("p_roll", 40)) is Cause.OCCUPIED
    assert cause_of(client.save()) is Cause.OCCUPIED


def test_settings_are_unknown_without_a_board() -> None:
    world = World(powered=False)
    client = SettingsClient(world)
    assert cause_of(client.change("p_roll", 40)) is Cause.NO_LINK
    assert cause_of(client.save()) is Cause.NO_LINK
    result = client.current()
    assert isinstance(result, SettingRefusal)


def test_a_strangers_name_is_safe_to_print_in_the_refusal() -> None:
    _, client = ready(BOARDS["patched Harakiri"])
    refused = client.change("\x1b[2J", 1)
    assert isinstance(refused, SettingRefusal)
    assert refused.text == "There is no setting [2J"


def test_losing_the_board_ends_a_change() -> None:
    world, _ = ready(BOARDS["patched Harakiri"])
    results: list[Answer] = []
    settings = inside(world.bridge).board_settings
    for value in (40, 41, 42):
        settings.change("p_roll", value, lambda result, _at: results.append(result), world.now, "test")
    world.unplug()
    world.run(1)
    assert [cause_of(result) for result in results] == [Cause.NO_ANSWER] * 3


def test_a_flood_of_changes_is_bounded_for_each_client_and_for_all() -> None:
    world, _ = ready(BOARDS["patched Harakiri"])
    results: list[Answer] = []
    settings = inside(world.bridge).board_settings
    for client in range(20):
        for value in range(20):
            settings.change("p_roll", value + 1, lambda result, _at: results.append(result), world.now, str(client))
    refused = [result for result in results if isinstance(result, SettingRefusal)]
    assert len(refused) == 400 - 64
    world.run(30)
    assert len(results) == 400
