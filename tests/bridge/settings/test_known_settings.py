# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that change on the board without the bridge are reported once, by name; changes through it are not.

A backup is taken when a board is met, when its settings were saved, and when they changed without the bridge.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.model.settings import BoardId, SettingsMemory, Value
from protocols.mission_item import MissionResult
from protocols.msp.frame import Direction, MspFrame, MspParser
from protocols.msp.mission import MissionCommand
from protocols.msp.setting_table import SettingCommand, encode_set_setting
from simulator.board.msp_board import MspBoard
from simulator.board.options import Faults, SimOptions
from simulator.board.telemetry_only import BETAFLIGHT, TelemetryFirmware
from simulator.commands.fc_kinds import make_board
from simulator.naze.board import SimulatedNaze
from simulator.naze.setting_table import SETTINGS
from tests.support.conversations import Upload, waypoints
from tests.support.seeds import seeds
from tests.support.settings_client import BOARDS, SettingsClient, ready, restart, value_of
from tests.support.share_program import ShareProgram
from tests.support.world import GroundStation, Radio, World, ready_world

SET_PID, SET_BOX, SET_MISC, SET_MODE_RANGE, SET_PID_V2 = 202, 203, 207, 35, 0x2031
RC_TUNING, PID, MISC, SETTING = 111, 112, 114, SettingCommand.SETTING
#: Longer than the interval between two readings.
ROUND_S = 65.0


def set_setting(name: str, value: float) -> bytes:
    """The payload that sets a setting of a patched Harakiri."""
    index = [held.setting.name for held in SETTINGS].index(name)
    (frame,) = MspParser().feed(encode_set_setting(index, SETTINGS[index].setting, value))
    return frame.payload


@dataclass(frozen=True)
class Case:
    """A change of a simulated board's settings by one request, and the names in the report."""

    make: Callable[[], object]
    command: int
    payload: bytes
    told: str


naze, inav, multiwii = SimulatedNaze, partial(make_board, "inav"), partial(make_board, "multiwii")
MULTIWII_PIDS, INAV_PIDS = bytes((33, 30, 23)) * 10, bytes((40, 30, 23, 60)) * 11
CASES = {
    "Naze": Case(naze, SettingCommand.SET_SETTING, set_setting("p_roll", 65), "p_roll"),
    "INAV, PIDs": Case(inav, SET_PID_V2, INAV_PIDS[:7] + b"\x01" + INAV_PIDS[8:], "mc_cd_pitch"),
    "INAV, modes": Case(inav, SET_MODE_RANGE, bytes((1, 11, 1, 32, 48)), "MODE_ANGLE, MODE_NAV_POSHOLD"),
    "MultiWii, PIDs": Case(multiwii, SET_PID, MULTIWII_PIDS[:6] + b"\x50" + MULTIWII_PIDS[7:], "YAW_P"),
    "MultiWii, modes": Case(multiwii, SET_BOX, b"\x04\x00\x01" + bytes(21), "BOX_ANGLE"),
    "MultiWii, MISC": Case(multiwii, SET_MISC, b"\0\0\x01" + bytes(19), "MIN_THROTTLE"),
}


def sealed(make: Callable[[], object], memory: SettingsMemory | None = None) -> tuple[World, GroundStation]:
    """A world whose board's settings were read."""
    world = ready_world(peer=make(), memory=memory, within_s=40)
    world.wait_until(lambda world: world.inside.board_settings.known.state is not None, 60)
    station = GroundStation(world).stay_connected()
    return world, station


def on_the_board(world: World, command: int, payload: bytes) -> None:
    """Change settings without the bridge, as from the board's USB socket. Its reply goes nowhere."""
    world.naze.receive(MspFrame(Direction.REQUEST, command, payload).encode(), world.now)
    world.naze.advance(world.now + 0.02)


def commands(world: World, since: float) -> list[int]:
    return [frame.command for frame in world.requests(since)]


def warnings(station: GroundStation) -> list[str]:
    """The reports of changed settings that a ground station got; chunks are joined."""
    words = " ".join(message.text for message in station.messages("STATUSTEXT")).split()
    return [f"Settings {text.strip()}" for text in " ".join(words).split("Settings ")[1:]]


@pytest.mark.parametrize("name", CASES)
def test_a_change_without_the_bridge_is_reported_once_by_name(name: str) -> None:
    case = CASES[name]
    world, station = sealed(case.make)
    before = world.bridge.report(world.now).settings
    assert before is not None
    assert before.changed is None
    on_the_board(world, case.command, case.payload)
    world.run(ROUND_S * (2 if case.make is naze else 1))
    told = f"Settings changed elsewhere: {case.told}"
    (event,) = world.events("settings.changed_on_board")
    assert (event.level, event.facts["detail"]) == ("warning", told)
    # The HUD gets as many names as fit, after the whole text for the Messages tab.
    assert warnings(station) == [told] + ["Settings changed elsewhere: MODE_ANGLE, +1"] * (len(told) > 50)
    after = world.bridge.report(world.now).settings
    assert after is not None
    assert (after.changed, after.seal == before.seal) == (told, False)


@pytest.mark.parametrize("name", ["Naze", "INAV, modes", "MultiWii, PIDs"])
def test_a_change_through_the_bridge_is_not_reported(name: str) -> None:
    case = CASES[name]
    world, station = sealed(case.make)
    seal = world.inside.board_settings.known.state and world.inside.board_settings.known.state.seal
    reply = ShareProgram(world, may_write=True).outcome(case.command, case.payload)
    assert reply is not None
    assert reply.direction is Direction.REPLY
    world.run(ROUND_S)
    assert world.events("settings.changed_on_board") == []
    assert warnings(station) == []
    assert world.inside.board_settings.known.state is not None
    assert world.inside.board_settings.known.state.seal != seal
    # A later change on the board is compared with it.
    on_the_board(world, case.command, set_setting("p_roll", 50) if case.make is naze else bytes(len(case.payload)))
    world.run(ROUND_S)
    assert len(world.events("settings.changed_on_board")) == 1


def test_a_change_of_any_other_setting_of_a_patched_harakiri_is_reported_and_all_are_read_again() -> None:
    world, station = sealed(naze)
    client = SettingsClient(world)
    client.wait_read()
    world.run(1)
    on_the_board(world, SettingCommand.SET_SETTING, set_setting("nav_speed_max", 777))
    world.run(ROUND_S + 10)  # the others take some seconds to be read
    (event,) = world.events("settings.changed_on_board")
    assert event.facts["detail"] == "Settings changed elsewhere: nav_speed_max"
    assert warnings(station) == [event.facts["detail"]]
    assert client.value("nav_speed_max") == 777


def test_the_radius_set_and_a_calibration_begun_by_a_station_are_not_reported() -> None:
    world, station = sealed(naze)
    SettingsClient(world).wait_read()
    station.send(messages.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 450, 9), wait_s=ROUND_S)
    assert SettingsClient(world).value("gps_wp_radius") == 450
    parameters = (0, 0, 0, 0, 4, 0, 0)
    station.send(messages.MAVLink_command_long_message(1, 1, messages.MAV_CMD_PREFLIGHT_CALIBRATION, 0, *parameters))
    world.run(1)
    on_the_board(world, SettingCommand.SET_SETTING, set_setting("rc_trm_rll", 1))
    world.run(ROUND_S)
    assert world.events("settings.changed_on_board") == []


def test_a_change_between_two_runs_is_reported() -> None:
    memory: dict[BoardId, Mapping[str, Value]] = {}
    sealed(naze, memory)
    board = naze()
    world = World(speeds=(115200,), peer=board, memory=memory)
    on_the_board(world, SettingCommand.SET_SETTING, set_setting("p_roll", 65))
    world.run(10)
    (event,) = world.events("settings.changed_on_board")
    assert event.facts["detail"] == "Settings changed elsewhere: p_roll"
    again, _ = sealed(lambda: board, memory)
    assert again.events("settings.changed_on_board") == []


def test_a_station_that_connects_later_is_informed_until_arming() -> None:
    world, _ = sealed(naze)
    on_the_board(world, SettingCommand.SET_SETTING, set_setting("p_roll", 65))
    world.run(ROUND_S)
    told = world.events("settings.changed_on_board")[0].facts["detail"]
    heartbeat = messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)
    late = GroundStation(world, "late")
    late.send(heartbeat)
    late.send(heartbeat, wait_s=1)
    assert warnings(late) == [told]
    world.arm(5, then_s=1)
    later = GroundStation(world, "later")
    later.send(heartbeat, wait_s=1)
    assert warnings(later) == []


def test_a_change_through_the_bridge_survives_a_restart_before_the_next_reading() -> None:
    memory: dict[BoardId, Mapping[str, Value]] = {}
    board = naze()
    world, _ = sealed(lambda: board, memory)
    on_the_board(world, SettingCommand.SET_SETTING, set_setting("p_roll", 65))
    world.inside.board_settings.may_have_changed(world.now)
    world.run(1)
    again, _ = sealed(lambda: board, memory)
    assert again.events("settings.changed_on_board") == []


@pytest.mark.parametrize("is_cut_off", [False, True])
def test_a_change_through_the_bridge_before_the_first_reading_is_not_reported(is_cut_off: bool) -> None:
    """An earlier run of the bridge has read the board. The first reading of this one may be cut off."""
    memory: dict[BoardId, Mapping[str, Value]] = {}
    board = naze()
    sealed(lambda: board, memory)
    world = ready_world(peer=board, memory=memory, within_s=40)
    assert world.inside.board_settings.known.state is None
    on_the_board(world, SettingCommand.SET_SETTING, set_setting("p_roll", 65))
    world.inside.board_settings.may_have_changed(world.now)
    if is_cut_off:
        began_at = world.now
        world.wait_until(lambda world: SETTING in commands(world, began_at), 20)
        assert world.inside.board_settings.known.state is None
        world.unplug()
        world.run(1)
        world.plug()
    world.wait_until(lambda world: world.inside.board_settings.known.state is not None, 60, then_s=1)
    assert world.events("settings.changed_on_board") == []


def test_another_board_is_not_a_change() -> None:
    memory: dict[BoardId, Mapping[str, Value]] = {}
    for make in (naze, inav, multiwii, naze):
        world, _ = sealed(make, memory)
        assert world.events("settings.changed_on_board") == []


def test_an_armed_board_is_not_asked_and_the_changes_are_reported_after_the_flight() -> None:
    world, _ = sealed(naze)
    world.arm(5)
    armed_at = world.now
    world.naze.faults.armed = False  # for its command line, which takes changes while armed
    on_the_board(world, SettingCommand.SET_SETTING, set_setting("p_roll", 65))
    world.naze.faults.armed = True
    world.run(ROUND_S)
    assert not {SETTING} & set(commands(world, armed_at))
    assert world.events("settings.changed_on_board") == []
    world.naze.faults.armed = False
    world.run(5)
    assert len(world.events("settings.changed_on_board")) == 1


def test_readings_wait_for_the_end_of_a_transfer() -> None:
    world, _ = sealed(naze)
    station = GroundStation(world, "slow", radio=Radio(delay_s=0.05))
    world.run(world.inside.board_settings._read_at - world.now - 0.1)
    began = world.now
    upload = Upload(station, waypoints(60))
    assert upload.run() is MissionResult.ACCEPTED
    assert world.now - began > 5
    world.run(5)
    asked = commands(world, began)
    assert max(at for at, command in enumerate(asked) if command == MissionCommand.COMMIT) < asked.index(SETTING)


def test_it_sends_a_few_requests_a_minute() -> None:
    for make in (naze, inav, multiwii):
        world, _ = sealed(make)
        ours = {SETTING, RC_TUNING, PID, MISC, 34, 0x2003, 0x2007, 0x2030, 0x2070}
        assert 0 < sum(frame.command in ours for frame in world.requests_during(ROUND_S)) <= 5 * 2


def test_a_board_without_the_commands_is_not_touched() -> None:
    """They are asked twice as settings, and twice for the seal."""
    firmware = partial(TelemetryFirmware, replace(BETAFLIGHT, settings={}))
    world = World(speeds=(115200,), peer=MspBoard(firmware, memoryview(bytearray(1))))
    world.run(300)
    asked = commands(world, 0.0)
    assert all(asked.count(command) <= 4 for command in (RC_TUNING, PID, MISC, 34))
    assert world.bridge.report(world.now).settings is None
    assert not [event for event in world.log_event if event.level == "warning"]


@pytest.mark.parametrize("seed", seeds(1))
def test_a_line_that_damages_frames_does_not_cause_a_report(seed: int) -> None:
    world = ready_world(seed=seed, within_s=40)
    world.faults.bit_error_rate = 1e-3
    world.run(400)
    assert world.events("settings.changed_on_board") == []


# Backups.


def occasions(world: World) -> list[str]:
    return [backup.occasion.value for backup in world.backups]


def test_changes_are_backed_up_only_once_they_are_saved() -> None:
    world, client = ready(BOARDS["patched Harakiri"])
    world.wait_until(lambda world: bool(world.backups), 20)
    value_of(client.change("p_roll", 44))
    world.inside.board_settings.may_have_changed(world.now)
    world.run(10)
    assert occasions(world) == ["connected"]
    assert client.save() is None
    world.run(5)
    assert occasions(world) == ["connected", "saved"]
    assert world.backups[-1].values["p_roll"] == 44


def test_unsaved_changes_that_a_restart_has_lost_no_longer_prevent_a_backup() -> None:
    world, client = ready(BOARDS["patched Harakiri"])
    world.wait_until(lambda world: bool(world.backups), 20)
    value_of(client.change("p_roll", 44))
    restart(world)
    world.run(10)
    assert occasions(world)[:2] == ["connected", "connected"]
    assert world.backups[-1].values == world.backups[0].values


def test_an_armed_board_is_backed_up_after_it_has_disarmed() -> None:
    faults = Faults(armed=True)
    world = World(SimOptions(), faults, speeds=(115200,))
    world.wait_until(lambda world: world.is_found, 20, then_s=20)
    assert world.backups == []
    faults.armed = False
    world.wait_until(lambda world: bool(world.backups), 30)
