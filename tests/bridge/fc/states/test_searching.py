# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding the flight controller in simulated time: at every speed, mid-frame, booting, power-cycled, armed."""

import random
from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers import other
from bridge.controllers.harakiri import profile as harakiri
from bridge.fc.states.base import Closed
from bridge.fc.states.searching import SPEEDS, Searching
from protocols.msp.frame import request
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from tests.support.fake_controllers import Loopback, MavlinkOnly, QuietLine
from tests.support.seeds import seeds
from tests.support.world import World

ALL_SPEEDS = sorted(set(SPEEDS), reverse=True)


def verdict(world: World) -> bool:
    return not isinstance(world.inside.session.state, Closed | Searching)


def reports_armed(world: World) -> bool | None:
    return world.bridge.vehicle.armed


@pytest.mark.parametrize("extension", [True, False])
@pytest.mark.parametrize("baud", ALL_SPEEDS)
def test_a_board_is_found_within_seconds_at_every_speed(baud: int, extension: bool) -> None:
    for seed in seeds(2):
        world = World(SimOptions(baud=baud), Faults(extension=extension), plugged=False)
        # A random phase of the board's heartbeat.
        world.run(random.Random(seed).random() * 4)
        world.plug()
        found_after_s = world.wait_until(verdict, 20)
        assert found_after_s <= (1.5 if baud == SPEEDS[0] else 8)
        # At 1200 baud reading the box names twice takes two seconds.
        assert found_after_s + world.wait_ready() <= (8 if baud >= 2400 else 12)
        assert world.kind is (harakiri.PATCHED if extension else harakiri.UNPATCHED)
        assert world.inside.session.state.speed == baud
        found = world.events("fc.found")
        assert [event.facts["speed_baud"] for event in found] == [baud]
        assert "two equal answers" in str(found[0].facts["why"])
        world.run(5)
        assert world.is_found
        world.assert_line_was_clean()


@pytest.mark.parametrize("extension", [True, False])
def test_a_board_left_in_mid_frame_is_found(extension: bool) -> None:
    frame = request(200, bytes(64))
    for length in range(1, len(frame), 5):
        world = World(faults=Faults(extension=extension), plugged=False)
        world.naze.receive(frame[:length], world.now)
        world.run(0.02)
        world.plug()
        assert world.wait_ready() <= 1.5
        world.assert_line_was_clean()


@pytest.mark.parametrize("extension", [True, False])
def test_losing_the_end_of_a_frame_later_does_not_lose_the_board(extension: bool) -> None:
    frame = request(200, bytes(64))
    for length in range(1, len(frame), 7):
        world = World(faults=Faults(extension=extension))
        world.wait_ready()
        world.naze.receive(frame[:length], world.now)
        world.run(3)
        assert world.events("fc.lost") == []
        link = world.inside.session.state.link
        assert link is not None
        assert world.now - link.last_heard_at < 0.5
        world.assert_line_was_clean()


@pytest.mark.parametrize("boot_ms", [0, 300, 1000, 1500, 2000, 2700, 3500, 6000])
@pytest.mark.parametrize("extension", [True, False])
def test_a_board_that_boots_while_the_port_opens_is_found(boot_ms: float, extension: bool) -> None:
    world = World(SimOptions(boot_ms=boot_ms), Faults(extension=extension), powered=False)
    world.power_on()
    assert world.wait_ready() <= boot_ms / 1000 + 3
    world.assert_line_was_clean()


@pytest.mark.parametrize("baud", ALL_SPEEDS)
def test_a_board_is_found_within_3_s_of_the_ports_return(baud: int) -> None:
    draw = random.Random(baud)
    for _ in seeds(3):
        world = World(SimOptions(baud=baud))
        world.wait_until(verdict, 10)
        # The speed may already be known when the port is lost.
        world.run(draw.random() * draw.choice((0.2, 4)))
        world.unplug()
        assert isinstance(world.inside.session.state, Closed)
        world.run(draw.choice((0.001, draw.random() * 8)))
        world.plug()
        assert world.wait_until(verdict, 20) <= 3
        if baud >= 4800:
            world.wait_until(lambda w: w.is_found, 3)
        world.wait_ready()
        world.assert_line_was_clean()


@pytest.mark.parametrize("protocol", [TelemetryProtocol.MAVLINK, TelemetryProtocol.MAVLINK_57600])
def test_a_board_that_is_armed_from_the_start_is_found(protocol: TelemetryProtocol) -> None:
    world = World(SimOptions(tele_prot=protocol), Faults(armed=True))
    world.run(0.5)
    assert world.naze.armed
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 3)
    assert "no answer to" in str(world.events("fc.found")[0].facts["why"])
    world.faults.armed = False
    world.wait_until(lambda w: w.kind is harakiri.PATCHED, 8)
    world.assert_line_was_clean()


@pytest.mark.parametrize("version", [1, 2])
def test_one_heartbeat_a_second_is_recognised_as_mavlink(version: int) -> None:
    world = World(peer=MavlinkOnly(version))
    assert world.wait_until(lambda w: w.is_found, 5) <= 1.5
    assert world.kind is other.OTHER_MAVLINK
    world.run(20)
    assert world.kind is other.OTHER_MAVLINK
    assert world.events("fc.lost") == []


def test_an_empty_heartbeat_is_ignored() -> None:
    """MAVLink 2 drops trailing zeros: an empty heartbeat is one byte long."""
    world = World(peer=MavlinkOnly())
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 3)
    mavlink = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    for fields in ((0, 0, 0, 0, 0, 0), (2, 3, 0x80, 0, 3, 0), (2, 3, 0x80 | 81, 0, 4, 3)):
        for version in (1, 2):
            message = messages.MAVLink_heartbeat_message(*fields)
            world.receive_from_fc(bytes(message.pack(mavlink, force_mavlink1=version == 1)))
    assert reports_armed(world) is True


def test_a_radio_with_a_ground_station_behind_it_is_not_a_flight_controller() -> None:
    world = World(peer=QuietLine())
    radio, station = messages.MAVLink(None, 51, 68), messages.MAVLink(None, 255, 190)
    for _ in range(30):
        world.receive_from_fc(bytes(messages.MAVLink_radio_status_message(0, 0, 100, 0, 0, 0, 0).pack(radio)))
        world.receive_from_fc(bytes(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(station)))
        world.receive_from_fc(bytes(messages.MAVLink_request_data_stream_message(1, 1, 0, 4, 1).pack(station)))
        world.run(0.5)
    assert world.events("fc.found") == []


@pytest.mark.parametrize("peer", [QuietLine, Loopback])
def test_an_empty_line_does_not_yield_a_flight_controller(peer: Callable[[], QuietLine]) -> None:
    world = World(peer=peer())
    world.run(60)
    assert isinstance(world.inside.session.state, Searching)
    assert world.events("fc.found") == world.events("fc.in_command_line") == []


def test_a_looped_back_line_is_not_mistaken_for_a_board() -> None:
    """The adapter's RX and TX wires touch after the flight controller was unplugged from it."""
    world = World()
    world.wait_ready()
    world.naze = Loopback()
    world.run(3)
    assert world.kind is None
