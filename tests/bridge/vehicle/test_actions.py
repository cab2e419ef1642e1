# SPDX-License-Identifier: GPL-3.0-or-later
"""Calibrations run once, only on the ground, and are acknowledged with the result."""

import math
from collections.abc import Callable
from functools import partial

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.dialect import Message
from simulator.board.msp_sensors import SensorReplies
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from tests.support.conversations import waypoints
from tests.support.fake_controllers import HARAKIRI_CAPABILITY, MspFake, ident
from tests.support.seeds import seeds
from tests.support.world import GroundStation, World, ready_world

m = messages
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = range(6)
CALIBRATION, STORAGE = 241, 245
#: Calibrations and EEPROM_WRITE.
ACTIONS = {205, 206, 250}
ACCELEROMETER = (CALIBRATION, (0, 0, 0, 0, 1, 0, 0), 205)
SIMPLE_ACCELEROMETER = (CALIBRATION, (0, 0, 0, 0, 4, 0, 0), 205)
COMPASS = (CALIBRATION, (0, 1, 0, 0, 0, 0, 0), 206)
ALL = (ACCELEROMETER, SIMPLE_ACCELEROMETER, COMPASS)
#: The sensors by the number of their calibration's request.
NAMES = {205: "Accel", 206: "Compass"}


def a_world(options: SimOptions | None = None, faults: Faults | None = None) -> tuple[World, GroundStation]:
    world = ready_world(options, faults)
    world.run(1)
    station = GroundStation(world)
    station.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3), wait_s=0.1)
    world.written.clear()
    return world, station


def long(command: int, params: tuple[float, ...]) -> Message:
    return m.MAVLink_command_long_message(1, 1, command, 0, *params)


def integer(command: int, params: tuple[float, ...]) -> Message:
    x, y = int(params[4]), int(params[5])
    return m.MAVLink_command_int_message(1, 1, 3, command, 0, 0, *params[:4], x, y, params[6])


def results(station: GroundStation) -> list[int]:
    return [ack.result for ack in station.messages("COMMAND_ACK") if station.is_target_of(ack)]


def done(world: World) -> list[int]:
    """The actions executed by the flight controller."""
    return [frame.command for frame in world.requests() if frame.command in ACTIONS]


@pytest.mark.parametrize("make", [long, integer])
@pytest.mark.parametrize(("command", "params", "action"), ALL)
def test_an_action_is_done_once_on_the_ground(
    make: Callable[[int, tuple[float, ...]], Message], command: int, params: tuple[float, ...], action: int
) -> None:
    world, station = a_world()
    station.send(make(command, params), wait_s=0.6)
    assert results(station) == [IN_PROGRESS]
    assert done(world) == [action]
    assert station.texts()[-1] == "Calibrating: the board then reboots (up to 5 min)"
    world.run(20)
    # The board restarts after a calibration and is found again.
    assert world.naze.counters.resets == (action == 205)
    assert action == 206 or world.is_found
    assert done(world) == [action]


def assert_not_done(
    world: World, station: GroundStation, command: int, params: tuple[float, ...], result: int, said: str
) -> None:
    station.send(long(command, params), wait_s=0.5)
    assert results(station) == [result]
    assert said in station.texts()[0]
    assert done(world) == []


@pytest.mark.parametrize(
    ("command", "params", "result", "said"),
    [
        *(
            (STORAGE, (what, 0, 0, 0, 0, 0, 0), DENIED, "Settings can be saved, but not loaded or reset")
            for what in (0, 2, math.nan, math.inf)
        ),
        (CALIBRATION, (0, 0, 0, 1, 0, 0, 0), UNSUPPORTED, ""),  # radio control
        (CALIBRATION, (0, 1, 0, 0, 1, 0, 0), UNSUPPORTED, ""),  # two at once
        (CALIBRATION, (0, 0, 0, 0, 0, 0, 0), UNSUPPORTED, ""),
        (CALIBRATION, (math.nan, 0, 0, 0, 0, 0, 0), UNSUPPORTED, ""),
    ],
)
def test_other_actions_are_refused(command: int, params: tuple[float, ...], result: int, said: str) -> None:
    assert_not_done(*a_world(), command, params, result, said)


@pytest.mark.parametrize(("command", "params", "action"), ALL)
def test_does_not_act_while_armed(command: int, params: tuple[float, ...], action: int) -> None:
    world, station = a_world()
    # Even before the bridge has noticed that it is armed.
    world.faults.armed = True
    assert_not_done(world, station, command, params, DENIED, f"{NAMES[action]} calibration failed: armed")


def test_calibrating_a_missing_sensor_is_denied(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("simulator.board.msp_port.SensorReplies", partial(SensorReplies, sensors=0b1011))
    assert_not_done(*a_world(), *COMPASS[:2], DENIED, "Compass calibration failed: no such sensor")


@pytest.mark.parametrize("tele_prot", [TelemetryProtocol.MAVLINK, TelemetryProtocol.FRSKY_9600])
def test_does_not_act_unless_the_arming_state_can_be_read(tele_prot: TelemetryProtocol) -> None:
    world, station = a_world(SimOptions(tele_prot=tele_prot))
    world.faults.armed = True
    for seconds in (0.02, 0.3, 4.0):
        world.run(seconds)
        station.ask(long(*COMPASS[:2]), wait_s=3)
        assert len(results(station)) == 1
        assert results(station)[0] in (DENIED, FAILED)
    assert done(world) == []


def test_on_unknown_firmware_an_action_is_unsupported() -> None:
    """Its handlers are not known, so the numbers may mean something else."""
    board = MspFake({100: ident(230, HARAKIRI_CAPABILITY), 101: bytes(11), 116: b"ANGLE;ARM;"})
    world = World(speeds=(115200,), peer=board)
    world.wait_until(lambda w: w.bridge.vehicle.armed is False, 5)
    station = GroundStation(world)
    for command, params, _ in ALL:
        station.send(long(command, params), wait_s=0.1)
    assert results(station) == [UNSUPPORTED] * len(ALL)
    assert done(world) == []


def test_an_action_on_a_board_that_falls_silent_fails_and_is_not_repeated() -> None:
    world, station = a_world()
    station.on_message.append(lambda _: None)
    hung: list[float] = []

    def hang_once_told() -> None:
        if not hung and done(world):
            world.faults.hang = True
            hung.append(world.now)
        elif not hung:
            world.after(0.0005, hang_once_told)

    hang_once_told()
    station.send(long(*ACCELEROMETER[:2]), wait_s=3)
    assert hung
    assert results(station) == [FAILED]
    assert station.texts()[0] == "Accel calibration failed: no answer"
    world.faults.hang = False
    world.run(30)
    assert done(world) == [205]


def test_despite_lost_bytes_an_action_is_done_at_most_once() -> None:
    for seed in seeds(4):
        world, station = a_world(SimOptions(seed=seed))
        world.faults.lost_byte_rate = 0.02
        station.send(long(*COMPASS[:2]), wait_s=4)
        assert len(done(world)) <= 1
        assert results(station) in ([IN_PROGRESS], [FAILED])


def test_a_repeated_command_is_answered_in_progress() -> None:
    world, station = a_world()
    for _ in range(3):
        station.send(long(*ACCELEROMETER[:2]))
    station.send(long(*COMPASS[:2]), wait_s=0.6)
    assert results(station) == [IN_PROGRESS, IN_PROGRESS, TEMPORARILY_REJECTED, IN_PROGRESS]
    assert done(world) == [205]


def test_no_action_runs_during_a_mission_transfer() -> None:
    world, station = a_world()
    outcome = world.push(waypoints(100))
    station.send(long(*COMPASS[:2]), wait_s=0.05)
    assert results(station) == [TEMPORARILY_REJECTED]
    assert station.texts() == ["Compass calibration failed: a transfer is running"]
    world.wait_until(lambda _: bool(outcome), 5)
    assert " stored: " in outcome[0][0].text
    assert done(world) == []


def test_no_other_command_reaches_the_flight_controller() -> None:
    world, station = a_world()
    for command in (
        *range(CALIBRATION),
        *range(246, 700),
        *range(3000, 3010),
        *range(42400, 42424),
        *range(42425, 42800),
    ):
        station.send(long(command, (1, 1, 1, 1, 1, 1, 1)))
    world.run(1)
    # 197 only reads a setting.
    assert all(frame.command < 190 or frame.command == 197 for frame in world.requests())
    assert not world.naze.armed


# Texts of refusals.


@pytest.mark.parametrize("current", [2, 3])
def test_a_guided_item_is_refused_at_once(current: int) -> None:
    _world, station = a_world()
    here = (45.3838, 8.4733, 20.0)
    station.send(m.MAVLink_mission_item_message(1, 1, 0, 3, 16, current, 0, 0, 0, 0, 0, *here), wait_s=0.1)
    (ack,) = station.messages("MISSION_ACK")
    assert station.is_target_of(ack)
    assert ack.type == m.MAV_MISSION_DENIED
    assert "transmitter" in station.texts()[0]
    station.take()
    e7 = (453838000, 84733000, 20.0)
    station.send(m.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, current, 0, 0, 0, 0, 0, *e7), wait_s=0.1)
    assert [ack.type for ack in station.messages("MISSION_ACK")] == [m.MAV_MISSION_DENIED]
    assert station.texts() == []
