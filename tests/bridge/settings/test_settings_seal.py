# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that change on the board without the bridge are reported once, by name; changes through it are not."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.config import BridgeConfig
from bridge.model.settings import BoardId, ChangedPart, Seal, SealsOfThisRun, SettingsChange
from protocols.mission_item import MissionResult
from protocols.msp.frame import Direction, MspFrame, MspParser
from protocols.msp.mission import MissionCommand
from protocols.msp.setting_table import SettingCommand, encode_set_setting
from protocols.msp.settings import Part
from simulator.board.msp_board import MspBoard
from simulator.board.telemetry_only import BETAFLIGHT, TelemetryFirmware
from simulator.commands.fc_kinds import make_board
from simulator.naze.board import SimulatedNaze
from simulator.naze.setting_table import SETTINGS
from tests.support.conversations import Upload, waypoints
from tests.support.settings_client import SettingsClient
from tests.support.share_program import ShareProgram
from tests.support.world import GroundStation, Radio, World

SET_PID, SET_BOX, SET_RC_TUNING, SET_MISC, SET_MODE_RANGE, SET_PID_V2 = 202, 203, 204, 207, 35, 0x2031
RC_TUNING, PID, BOX, MISC = 111, 112, 113, 114
#: Longer than the interval between two readings.
ROUND_S = 65.0


@dataclass(frozen=True)
class Case:
    """A change of a simulated board's settings by one request, and the part and names in the report."""

    make: Callable[[], object]
    command: int
    payload: bytes
    told: str


def naze() -> SimulatedNaze:
    return SimulatedNaze()


def inav() -> object:
    return make_board("inav")


def multiwii() -> object:
    return make_board("multiwii")


NAZE_PIDS, MULTIWII_PIDS, INAV_PIDS = bytes((40, 30, 23)) * 10, bytes((33, 30, 23)) * 10, bytes((40, 30, 23, 60)) * 11
CASES = {
    "Naze, PIDs": Case(naze, SET_PID, b"\x41\x1e\x17" + NAZE_PIDS[3:27] + b"\x01\x01\x01", "PIDs ROLL, VEL"),
    "Naze, rates": Case(naze, SET_RC_TUNING, bytes((90, 65, 0, 9, 0, 50, 1)), "rates yaw rate, throttle expo"),
    "INAV, PIDs": Case(inav, SET_PID_V2, INAV_PIDS[:7] + b"\x01" + INAV_PIDS[8:], "PIDs PITCH"),
    "INAV, modes": Case(inav, SET_MODE_RANGE, bytes((1, 11, 1, 32, 48)), "modes ANGLE, NAV POSHOLD"),
    "MultiWii, PIDs": Case(multiwii, SET_PID, MULTIWII_PIDS[:6] + b"\x50" + MULTIWII_PIDS[7:], "PIDs YAW"),
    "MultiWii, modes": Case(multiwii, SET_BOX, b"\x04\x00\x01" + bytes(21), "modes ANGLE"),
    "MultiWii, MISC": Case(multiwii, SET_MISC, b"\0\0\x01" + bytes(19), "MISC min throttle"),
}


def sealed(make: Callable[[], object], seals: SealsOfThisRun | None = None) -> tuple[World, GroundStation]:
    """A world whose board's settings were read."""
    world = World(speeds=(115200,), peer=make(), seals=seals)
    world.wait_ready(40)
    world.wait_until(lambda world: world.inside.seal.state is not None, 20)
    station = GroundStation(world)

    def beat() -> None:
        station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        world.after(5, beat)

    beat()
    return world, station


def on_the_board(world: World, command: int, payload: bytes) -> None:
    """Change settings without the bridge, as from the board's USB socket. Its reply goes nowhere."""
    world.naze.receive(MspFrame(Direction.REQUEST, command, payload).encode(), world.now)
    world.naze.advance(world.now + 0.02)


def warnings(station: GroundStation) -> list[str]:
    """The reports of changed settings that a ground station got; chunks are joined."""
    words = " ".join(message.text for message in station.messages("STATUSTEXT")).split()
    return [f"Settings {text.strip()}" for text in " ".join(words).split("Settings ")[1:]]


def requests(world: World, since: float) -> list[int]:
    return [frame.command for at, _, data in world.written if at >= since for frame in MspParser().feed(data)]


@pytest.mark.parametrize("name", CASES)
def test_a_change_without_the_bridge_is_reported_once_by_name(name: str) -> None:
    case = CASES[name]
    world, station = sealed(case.make)
    before = world.bridge.report(world.now).settings
    assert before is not None
    assert before.changed is None
    on_the_board(world, case.command, case.payload)
    world.run(2 * ROUND_S)
    told = f"Settings changed elsewhere: {case.told}"
    (event,) = world.events("settings.changed_on_board")
    assert (event.level, event.facts["detail"]) == ("warning", told)
    assert warnings(station) == [told]
    after = world.bridge.report(world.now).settings
    assert after is not None
    assert (after.changed, after.seal == before.seal) == (told, False)


@pytest.mark.parametrize("name", CASES)
def test_a_change_through_the_bridge_is_not_reported(name: str) -> None:
    case = CASES[name]
    world, station = sealed(case.make)
    seal = world.inside.seal.state and str(world.inside.seal.state.seal)
    reply = ShareProgram(world, may_write=True).outcome(case.command, case.payload)
    assert reply is not None
    assert reply.direction is Direction.REPLY
    world.run(ROUND_S)
    assert world.events("settings.changed_on_board") == []
    assert warnings(station) == []
    assert world.inside.seal.state is not None
    assert str(world.inside.seal.state.seal) != seal
    # A later change on the board is compared with it.
    on_the_board(world, case.command, bytes(len(case.payload)))
    world.run(ROUND_S)
    assert len(world.events("settings.changed_on_board")) == 1


def set_on_the_board(world: World, name: str, value: float) -> None:
    index = [held.setting.name for held in SETTINGS].index(name)
    frame = encode_set_setting(index, SETTINGS[index].setting, value)
    world.naze.receive(frame, world.now)
    world.naze.advance(world.now + 0.02)


def test_a_change_of_any_other_setting_of_a_patched_harakiri_is_reported_and_all_are_read_again() -> None:
    world, station = sealed(naze)
    client = SettingsClient(world)
    client.wait_read()
    world.run(1)
    set_on_the_board(world, "nav_speed_max", 777)
    world.run(ROUND_S + 10)  # the others take some seconds to be read
    (event,) = world.events("settings.changed_on_board")
    assert event.facts["detail"] == "Settings changed elsewhere: other settings"
    assert warnings(station) == [event.facts["detail"]]
    assert client.value("nav_speed_max") == 777
    assert world.events("settings.read")[-1].facts["changed"] == "nav_speed_max"


def test_while_the_checksum_holds_a_list_comes_from_memory() -> None:
    world, _ = sealed(naze)
    client = SettingsClient(world)
    client.wait_read()
    world.run(1)
    before = world.now
    assert client.current() is not None
    assert requests(world, before).count(SettingCommand.SETTING) == 1


def test_the_radius_set_and_a_calibration_begun_by_a_station_are_not_reported() -> None:
    world, station = sealed(naze)
    SettingsClient(world).wait_read()
    station.send(messages.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 450, 9))
    world.run(ROUND_S)
    assert SettingsClient(world).value("gps_wp_radius") == 450
    parameters = (0, 0, 0, 0, 4, 0, 0)
    station.send(messages.MAVLink_command_long_message(1, 1, messages.MAV_CMD_PREFLIGHT_CALIBRATION, 0, *parameters))
    world.run(1)
    set_on_the_board(world, "rc_trm_rll", 1)
    world.run(ROUND_S)
    assert world.events("settings.changed_on_board") == []


def test_a_change_between_two_runs_is_reported() -> None:
    seals = SealsOfThisRun()
    sealed(naze, seals)
    board = naze()
    world = World(speeds=(115200,), peer=board, seals=seals)
    on_the_board(world, SET_PID, bytes(30))
    world.run(10)
    (event,) = world.events("settings.changed_on_board")
    assert str(event.facts["detail"]).startswith("Settings changed elsewhere: PIDs ROLL, PITCH, YAW, ")
    again, _ = sealed(lambda: board, seals)
    assert again.events("settings.changed_on_board") == []


def test_a_station_that_connects_later_is_told_until_the_craft_is_armed() -> None:
    world, _ = sealed(naze)
    on_the_board(world, SET_PID, bytes(30))
    world.run(ROUND_S)
    told = world.events("settings.changed_on_board")[0].facts["detail"]
    heartbeat = messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)
    late = GroundStation(world, "late")
    late.send(heartbeat)
    late.send(heartbeat)
    world.run(1)
    assert warnings(late) == [told]
    world.naze.faults.armed = True
    world.wait_until(lambda world: world.bridge.vehicle.armed is True, 5)
    world.run(1)
    later = GroundStation(world, "later")
    later.send(heartbeat)
    world.run(1)
    assert warnings(later) == []


def test_a_change_through_the_bridge_survives_a_restart_before_the_next_reading() -> None:
    seals = SealsOfThisRun()
    board = naze()
    world, _ = sealed(lambda: board, seals)
    on_the_board(world, SET_PID, bytes(30))
    world.inside.seal.changed_here(world.now)
    world.run(1)
    again, _ = sealed(lambda: board, seals)
    assert again.events("settings.changed_on_board") == []


def changed_before_the_first_reading() -> World:
    """A bridge through which settings are changed before it has read the board, as another run of it has."""
    seals = SealsOfThisRun()
    board = naze()
    sealed(lambda: board, seals)
    world = World(speeds=(115200,), peer=board, seals=seals)
    world.wait_ready(40)
    assert world.inside.seal.state is None
    on_the_board(world, SET_PID, bytes(30))
    world.inside.seal.changed_here(world.now)
    return world


def test_a_change_through_the_bridge_before_the_first_reading_is_not_reported() -> None:
    world = changed_before_the_first_reading()
    world.wait_until(lambda world: world.inside.seal.state is not None, 20)
    world.run(1)
    assert world.events("settings.changed_on_board") == []


def test_a_first_reading_that_is_cut_off_does_not_forget_a_change_through_the_bridge() -> None:
    world = changed_before_the_first_reading()
    began_at = world.now
    world.wait_until(lambda world: PID in requests(world, began_at), 20)
    assert world.inside.seal.state is None
    world.unplug()
    world.run(1)
    world.plug()
    world.wait_until(lambda world: world.inside.seal.state is not None, 40)
    world.run(1)
    assert world.events("settings.changed_on_board") == []


def test_another_board_is_no_change() -> None:
    seals = SealsOfThisRun()
    for make in (naze, inav, multiwii, naze):
        world, _ = sealed(make, seals)
        assert world.events("settings.changed_on_board") == []


def test_an_armed_board_is_not_asked_and_its_changes_are_reported_after_the_flight() -> None:
    world, _ = sealed(naze)
    world.naze.faults.armed = True
    world.wait_until(lambda world: world.bridge.vehicle.armed is True, 5)
    armed_at = world.now
    on_the_board(world, SET_PID, bytes((41, *NAZE_PIDS[1:])))
    world.run(ROUND_S)
    assert not {PID, RC_TUNING, MISC} & set(requests(world, armed_at))
    assert world.events("settings.changed_on_board") == []
    world.naze.faults.armed = False
    world.run(5)
    assert len(world.events("settings.changed_on_board")) == 1


def test_readings_wait_for_the_end_of_a_transfer() -> None:
    world, _ = sealed(naze)
    station = GroundStation(world, "slow", radio=Radio(delay_s=0.05))
    world.run(world.inside.seal.due - world.now - 0.1)
    began = world.now
    upload = Upload(station, waypoints(60))
    assert upload.run() is MissionResult.ACCEPTED
    assert world.now - began > 5
    world.run(5)
    asked = requests(world, began)
    assert max(at for at, command in enumerate(asked) if command == MissionCommand.COMMIT) < asked.index(PID)


def test_a_few_requests_a_minute() -> None:
    for make in (naze, inav, multiwii):
        world, _ = sealed(make)
        began = world.now
        world.run(2 * ROUND_S)
        ours = {RC_TUNING, PID, MISC, 34, 0x2003, 0x2007, 0x2030, 0x2070}
        asked = [command for command in requests(world, began) if command in ours]
        assert 0 < len(asked) <= 5 * 3


def test_a_board_without_the_commands_is_left_alone() -> None:
    """They are asked twice as settings, and twice for the seal."""
    firmware = partial(TelemetryFirmware, replace(BETAFLIGHT, settings={}))
    world = World(speeds=(115200,), peer=MspBoard(firmware, memoryview(bytearray(1))))
    world.run(300)
    asked = requests(world, 0.0)
    assert all(asked.count(command) <= 4 for command in (RC_TUNING, PID, MISC, 34))
    assert world.bridge.report(world.now).settings is None
    assert not [event for event in world.log_event if event.level == "warning"]


@pytest.mark.parametrize("seed", range(3))
def test_a_line_that_damages_frames_causes_no_report(seed: int) -> None:
    world = World(speeds=(115200,), seed=seed)
    world.wait_ready(40)
    world.faults.bit_error_rate = 1e-3
    world.run(400)
    assert world.events("settings.changed_on_board") == []


def test_a_text_is_cut_where_it_no_longer_fits() -> None:
    parts = [ChangedPart(Part.PIDS, tuple(f"PID {number}" for number in range(9))), ChangedPart(Part.MISC)]
    change = SettingsChange(parts, 0.0)
    assert "PID 8; MISC" in change.text()
    short = change.text(80)
    assert len(short) <= 80
    assert "+" in short
    assert short.endswith("; MISC")


def test_a_seal_depends_on_every_part() -> None:
    seals = {str(Seal(parts)) for parts in ({}, {Part.PIDS: b""}, {Part.PIDS: b"a"}, {Part.MISC: b"a"})}
    assert len(seals) == 4
    assert BridgeConfig((None,)).seals.recall(BoardId("x")) is None
