# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters: few, true, and set on the flight controller before they are confirmed."""

import math

import pytest

from bridge.controllers.harakiri.mission_store import HarakiriMissions
from bridge.missions.fc_mission_store import PushFailure
from protocols.mavlink.dialect import Message
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from tests.bridge.vehicle.test_commands import answers, m
from tests.support.screens import Screens
from tests.support.world import GroundStation, World, ready_world

#: The parameters of a patched Harakiri; of other boards one less.
COUNT = 36


def param_set(name: bytes, value: float) -> Message:
    return m.MAVLink_param_set_message(1, 1, name, value, 9)


def values(received: list[Message]) -> list[tuple[str, float, int, int]]:
    return [
        (message.param_id, message.param_value, message.param_index, message.param_count)
        for message in received
        if message.get_type() == "PARAM_VALUE"
    ]


def radius_world() -> tuple[World, GroundStation]:
    world = ready_world()
    return world, GroundStation(world)


def test_the_parameter_list_is_short_and_complete(flying: tuple[World, GroundStation]) -> None:
    received = answers(flying, m.MAVLink_param_request_list_message(1, 1))
    found = values(received)
    assert found[0] == ("SYSID_THISMAV", 1.0, 0, COUNT)
    assert found[-1] == ("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)
    assert [index for _, _, index, _ in found] == list(range(COUNT))
    assert {message.param_type for message in received} == {9}


@pytest.mark.parametrize(
    ("name", "index", "expected"),
    [
        (b"", 0, "SYSID_THISMAV"),
        (b"", 1, "RCMAP_ROLL"),
        (b"", 35, "WPNAV_RADIUS"),
        (b"WPNAV_RADIUS", -1, "WPNAV_RADIUS"),
        (b"SYSID_THISMAV", -1, "SYSID_THISMAV"),
        (b"WPNAV_RADIUS", 0, "SYSID_THISMAV"),  # the index takes precedence
        (b"", 36, None),
        (b"", 32767, None),
        (b"NO_SUCH_NAME", -1, None),
        (b"WPNAV_RADIUS1234", -1, None),
        (b"", -1, None),
        (b"WPNAV_RADIUS", -2, "WPNAV_RADIUS"),
        (b"\xff\xfe", -1, None),
    ],
)
def test_a_parameter_is_read_by_index_or_by_name(
    flying: tuple[World, GroundStation], name: bytes, index: int, expected: str | None
) -> None:
    received = answers(flying, m.MAVLink_param_request_read_message(1, 1, name, index))
    assert [value[0] for value in values(received)] == ([expected] if expected else [])


@pytest.mark.parametrize("board", ["harakiri", "inav", "multiwii"])
@pytest.mark.parametrize("is_armed", [False, True])
def test_qgroundcontrol_shows_no_dialog_and_stays_on_the_map(board: str, is_armed: bool) -> None:
    """It checks receiver, compass and accelerometer as soon as it has read the parameters."""
    faults = Faults(armed=is_armed, boxes=0)
    world = World(faults=faults, peer=None if board == "harakiri" else make_board(board, faults=faults))
    world.wait_until(lambda w: w.is_found, 20)
    world.run(3)
    station = GroundStation(world)
    screen = Screens(station).qgc
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(1)
    assert len(screen.parameters) >= COUNT - 1
    assert (screen.dialogs, screen.is_in_setup) == ([], False)
    assert screen._components_ok
    # These make Mission Planner ask for fences and show another compass page, and QGroundControl for a frame.
    assert not {"FENCE_TOTAL", "RALLY_TOTAL", "COMPASS_PRIO1_ID", "FRAME_CLASS"} & screen.parameters.keys()


def test_qgroundcontrol_is_ready_before_a_flight_controller_is_found() -> None:
    """It reads the parameters once; those of the board are sent when they are known."""
    world = World(powered=False)
    station = GroundStation(world)
    screen = Screens(station).qgc
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(1)
    assert (screen.dialogs, screen.is_in_setup, screen.parameters["COMPASS_USE"]) == ([], False, 0.0)
    world.power_on()
    world.run(world.naze.options.boot_ms / 1000 + 5)
    assert (screen.parameters["COMPASS_USE"], screen.parameters["COMPASS_OFS_X"]) == (1.0, 1.0)


@pytest.mark.parametrize(("blocker", "name"), [(13, "INS_ACCOFFS_X"), (12, "COMPASS_OFS_X")])
def test_a_sensor_that_inav_reports_as_not_calibrated_has_no_offset(blocker: int, name: str) -> None:
    faults = Faults(boxes=0)
    world = World(faults=faults, peer=make_board("inav", faults=faults))
    world.wait_ready()
    world.run(3)
    station = GroundStation(world)
    received = answers((world, station), m.MAVLink_param_request_list_message(1, 1))
    assert {value[0]: value[1] for value in values(received)}[name] != 0
    station.take()
    faults.arming_blockers = 1 << blocker
    world.run(3)
    assert values(station.messages("PARAM_VALUE"))[0][:2] == (name, 0.0)


def test_the_radius_is_set_on_the_flight_controller() -> None:
    world, station = radius_world()
    operations = world.naze.flash_operations
    other = GroundStation(world, "other", sysid=254)
    other.send(m.MAVLink_ping_message(0, 0, 0, 0))
    station.send(param_set(b"WPNAV_RADIUS", 350.0))
    world.wait_until(lambda _: bool(station.messages("PARAM_VALUE")), 1)
    assert values(station.messages()) == values(other.messages()) == [("WPNAV_RADIUS", 350.0, COUNT - 1, COUNT)]
    assert station.texts() == []
    world.run(2)
    # The firmware applies it in its next loop.
    assert world.naze.flash_operations > operations
    world.power_off()
    world.power_on()
    world.run(world.naze.options.boot_ms / 1000 + 3)
    assert values(answers((world, station), m.MAVLink_param_request_list_message(1, 1)))[-1][1] == 350.0


@pytest.mark.parametrize("value", [200.0, 200.4, 199.949, 199.99998])
def test_an_unchanged_value_is_not_written(value: float) -> None:
    world, station = radius_world()
    before, operations = len(world.written), world.naze.flash_operations
    received = answers((world, station), param_set(b"WPNAV_RADIUS", value))
    assert values(received) == [("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)]
    assert all(data[4] < 190 for _, _, data in world.written[before:])
    world.run(2)
    assert world.naze.flash_operations == operations


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1.0, 2001.0, 1e30])
def test_a_value_out_of_range_is_refused_with_a_text(value: float) -> None:
    world, station = radius_world()
    received = answers((world, station), param_set(b"WPNAV_RADIUS", value))
    assert values(received) == [("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)]
    assert station.texts() == ["WPNAV_RADIUS stays 200: 0..2000 cm"]


@pytest.mark.parametrize("value", [0.0, 1.0, 13.0, 35.0, 82.0, 209.99998, 2000.0])
def test_every_radius_in_range_is_set(value: float) -> None:
    world, station = radius_world()
    station.send(param_set(b"WPNAV_RADIUS", value))
    world.wait_until(lambda _: bool(station.messages("PARAM_VALUE")), 1)
    assert values(station.messages())[0][1] == round(value)
    world.assert_line_was_clean()


def test_a_parameter_that_cannot_be_set_is_answered_with_its_value() -> None:
    world, station = radius_world()
    for name, present in ((b"SYSID_THISMAV", 1.0), (b"RC3_MIN", 1000.0), (b"COMPASS_USE2", 0.0)):
        assert values(answers((world, station), param_set(name, 7.0)))[0][:2] == (name.decode(), present)
        assert station.texts() == [f"{name.decode()} is read-only"]
        # An unchanged value is no news.
        assert values(answers((world, station), param_set(name, present)))[0][:2] == (name.decode(), present)
        assert station.texts() == []
    (missing,) = answers((world, station), param_set(b"NO_SUCH_NAME", 7.0))
    assert (missing.get_type(), missing.param_id) == ("PARAM_ERROR", "NO_SUCH_NAME")
    assert missing.error == m.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_setting_the_radius_while_armed_is_refused_with_a_text() -> None:
    world, station = radius_world()
    world.faults.armed = True
    world.run(1)
    received = answers((world, station), param_set(b"WPNAV_RADIUS", 400.0))
    assert values(received) == [("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)]
    assert any("disarm" in text for text in station.texts())


def test_a_radius_refused_for_flash_wear_is_reported() -> None:
    world, station = radius_world()
    for radius_cm in range(301, 301 + 250):
        ended: list[object] = []
        change = world.inside.missions.fc_store.set_wp_radius(radius_cm)  # type: ignore[union-attr]
        world.inside.runner.start(change, lambda failure, _, ended=ended: ended.append(failure), world.now)  # type: ignore[misc]
        world.wait_until(lambda _, ended=ended: bool(ended), 5)  # type: ignore[misc]
        assert ended == [None]
    station.send(param_set(b"WPNAV_RADIUS", 400.0))
    world.wait_until(lambda _: bool(station.messages("PARAM_VALUE")), 5)
    assert values(station.messages()) == [("WPNAV_RADIUS", 550.0, COUNT - 1, COUNT)]
    assert " ".join(station.texts()) == f"WPNAV_RADIUS stays 550: {PushFailure.WRITES_SPENT.value}"


def test_setting_the_radius_of_a_silent_board_fails_with_a_text() -> None:
    world, station = radius_world()
    world.faults.hang = True
    station.send(param_set(b"WPNAV_RADIUS", 400.0))
    world.wait_until(lambda _: bool(station.texts()), 5)
    assert station.texts()[0] == "No answer: WPNAV_RADIUS may be set, read it again"


def test_a_radius_set_just_before_arming_is_not_reported_as_unchanged() -> None:
    """The board changes it, then speaks MAVLink before it is read back."""
    world = World(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), speeds=(115200,))
    world.wait_ready()
    station = GroundStation(world)
    station.send(param_set(b"WPNAV_RADIUS", 400.0))
    world.run(0.02)
    world.faults.armed = True
    world.wait_until(lambda _: bool(station.texts()), 10)
    assert station.texts() == ["No answer: WPNAV_RADIUS may be set, read it again"]
    world.faults.armed = False
    world.run(8)
    received = answers((world, station), m.MAVLink_param_request_read_message(1, 1, b"WPNAV_RADIUS", -1))
    assert ("WPNAV_RADIUS", 400.0, COUNT - 1, COUNT) in values(received)


def test_without_the_extension_there_is_no_radius() -> None:
    world = World(faults=Faults(extension=False))
    world.wait_ready()
    station = GroundStation(world)
    received = answers((world, station), m.MAVLink_param_request_list_message(1, 1), param_set(b"WPNAV_RADIUS", 300.0))
    assert "WPNAV_RADIUS" not in [name for name, *_ in values(received)]
    assert values(received)[0] == ("SYSID_THISMAV", 1.0, 0, COUNT - 1)


def test_repeated_sets_are_done_one_at_a_time() -> None:
    world, station = radius_world()
    for number in range(2000):
        station.send(param_set(b"WPNAV_RADIUS", 300.0 + number % 5))
        if number % 9 == 0:
            world.run(0.0001)
    world.run(4)
    received = answers((world, station), m.MAVLink_param_request_list_message(1, 1))
    assert 300 <= values(received)[-1][1] <= 304
    world.assert_line_was_clean()


def test_a_late_reply_to_the_first_set_does_not_confirm_the_second() -> None:
    """The board hangs after the first PARAM_SET and answers both when it resumes."""
    for hang_s in (0.1, 0.2, 0.3, 0.5, 0.8):
        world, station = radius_world()
        world.faults.hang = True
        station.send(param_set(b"WPNAV_RADIUS", 300.0))
        world.run(0.02)
        world.after(hang_s, lambda world=world: setattr(world.faults, "hang", False))  # type: ignore[misc]
        world.run(hang_s - 0.01)
        station.send(param_set(b"WPNAV_RADIUS", 500.0))
        world.run(3)
        radius_cm = values(station.messages())[-1][1]
        assert radius_cm == values(answers((world, station), m.MAVLink_param_request_list_message(1, 1)))[-1][1]
        info = world.inside.missions.fc_store
        assert isinstance(info, HarakiriMissions)
        assert world.naze._firmware._board.wp_radius_cm == info.wp_radius_cm == radius_cm
