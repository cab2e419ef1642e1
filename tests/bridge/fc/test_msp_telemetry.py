# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry from MSP polls: the messages match the craft, and the line is not overloaded."""

from collections import Counter
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.msp.commands import Msp
from protocols.msp.frame import MspParser
from simulator.board.options import Faults, SimOptions
from tests.support.conversations import waypoints
from tests.support.world import GroundStation, World

m = messages


def flown(seconds: float, *, baud: int = 115200, faults: Faults | None = None) -> tuple[World, GroundStation]:
    """A craft armed `seconds` ago, and a ground station that listens."""
    world = World(SimOptions(baud=baud), faults, speeds=(baud,))
    world.wait_ready(30)
    station = listening(world)
    world.faults.armed = True
    world.run(seconds)
    return world, station


def listening(world: World, name: str = "gcs") -> GroundStation:
    station = GroundStation(world, name)
    send_heartbeat(station)
    world.run(0.01)
    return station


def send_heartbeat(station: GroundStation) -> None:
    station.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))


def polls(world: World) -> Counter[int]:
    """The number of polls by command since `world.written` was cleared."""
    return Counter(frame.command for frame in world.requests())


def rate_hz(station: GroundStation, name: str, seconds: float) -> float:
    return len(station.messages(name)) / seconds


# The messages match the craft.


@pytest.mark.parametrize("baud", [19200, 9600])
def test_telemetry_continues_alongside_a_mission(baud: int) -> None:
    """A STATUS poll may be delayed by one interval and by a long CHUNK."""
    world = World(SimOptions(baud=baud), speeds=(baud,))
    world.wait_ready(30)
    station = listening(world)
    world.run(3)
    outcome = world.push(waypoints(140))
    began = world.now
    world.written.clear()
    station.take()
    world.wait_until(lambda _: bool(outcome), 60)
    seconds = world.now - began
    assert seconds > 1
    assert outcome[0][0].text.startswith("140 of 140 stored: ")
    asked = [at for at, _, data in world.written for frame in MspParser().feed(data) if frame.command == Msp.STATUS]
    assert max(later - earlier for earlier, later in pairwise([began, *asked, world.now])) <= 0.5 + 2530 / baud
    assert 1 <= rate_hz(station, "ATTITUDE", seconds) <= 6
    world.assert_line_was_clean()
