# SPDX-License-Identifier: GPL-3.0-or-later
"""Other programs and the image: a flood for a minute, an honest program and an upload beside it, and a flight."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mission_item import MissionResult
from protocols.msp.frame import Direction
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from tests.support.conversations import Upload, waypoints
from tests.support.real_bench import Figure
from tests.support.share_program import ShareProgram
from tests.support.world import GroundStation, World

#: All of the image's reads, and two of the numbers that it does not know.
_READS = [(command, b"") for command in (*range(100, 118), 254, 119, 150)] + [(118, b"\0"), (118, b"\x10")]
_MWP = (101, 110, 106, 107, 118, 108, 109)
_PID = 112
_FLOOD_S = 60
_STICKS_S = 5.0


@pytest.fixture
def world(image: Image, flash: bytes) -> World:
    world = World(speeds=(115200,), peer=EmulatedNaze(image, flash=memoryview(bytearray(flash))))
    world.wait_ready()
    return world


@pytest.fixture
def station(world: World) -> GroundStation:
    station = GroundStation(world)

    def beat() -> None:
        station.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        world.after(1.0, beat)

    beat()
    world.run(3)
    return station


def attitude_hz(world: World, station: GroundStation, seconds: float) -> float:
    station.take()
    world.run(seconds)
    return len(station.take("ATTITUDE")) / seconds


def test_a_minute_of_flood(world: World, station: GroundStation, figure: Figure) -> None:
    before = attitude_hz(world, station, 10)
    floods = [ShareProgram(world, f"192.0.2.{host}:1") for host in (66, 67)]
    for flood in floods:
        flood.ask_every(0.005, *_READS)
    honest = ShareProgram(world)
    honest.ask_every(1.0, (_PID, b""))
    beside = attitude_hz(world, station, _FLOOD_S)
    assert Upload(station, waypoints(60)).run() is MissionResult.ACCEPTED
    world.run(2)
    figure("attitude without and with two floods of 200/s", f"{before:.1f} and {beside:.1f} Hz")
    figure("replies to an honest program beside them", f"{len(honest.replies)} of {_FLOOD_S + 2}")
    assert beside >= 0.8 * before
    assert len(honest.replies) >= _FLOOD_S
    assert {frame.direction for _, frame in honest.replies} == {Direction.REPLY}
    assert [program.closed_at for program in (*floods, honest)] == [None] * 3
    assert world.events("fc.lost") == world.events("fc.in_command_line") == []


def test_a_display_in_flight(world: World, station: GroundStation, figure: Figure) -> None:
    program = ShareProgram(world)
    program.ask_in_turn(0.005, _MWP)
    world.run(2)
    world.naze.faults.armed = True
    world.wait_until(lambda world: bool(world.bridge.vehicle.armed), _STICKS_S)
    program.replies.clear()
    hz = attitude_hz(world, station, 10)
    figure("mwp's loop in flight", f"{len(program.replies) / 10:.0f} replies/s, attitude to the station {hz:.1f} Hz")
    assert program.closed_at is None
    assert {frame.command for _, frame in program.replies} == {*_MWP}
    assert len(program.replies) >= 100
