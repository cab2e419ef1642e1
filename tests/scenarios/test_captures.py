# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of flight controllers' ports (tests/captures), replayed to the bridge in simulated time.

Captures from users are added unchanged. The first test runs on every capture; each problem has its own test.
"""

from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.fc.states.base import Closed
from bridge.model.missions import Outcome
from protocols.mission_file import read_mission_file
from protocols.mission_item import MissionResult
from protocols.uart_capture import UartEvent, read_capture
from simulator.commands.playback import CapturePlayer
from tests.support.world import GroundStation, World

CAPTURES = Path(__file__).parents[1] / "captures"
MISSION = Path(__file__).parents[2] / "examples" / "naze-field.waypoints"
NAMES = sorted(path.name for path in CAPTURES.glob("*.uart"))


def events_of(name: str) -> list[UartEvent]:
    return read_capture((CAPTURES / name).read_bytes())


def world_of(name: str) -> World:
    """A world whose port comes and goes as in the recording."""
    player = CapturePlayer(events_of(name))
    world = World(peer=player)
    for closed, opened in player.outages:
        world.at(closed, world.unplug)
        world.at(opened, world.plug)
    return world


@pytest.mark.parametrize("name", NAMES)
def test_every_capture_is_played_to_its_end(name: str) -> None:
    world = world_of(name)
    station = GroundStation(world)
    station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    world.run(world.naze.duration_s)
    assert world.events("fc.found")
    heartbeats = [at for at, message in station.received if message.get_type() == "HEARTBEAT"]
    assert max(later - earlier for earlier, later in pairwise(heartbeats)) <= 1.5


def test_arming_and_disarming_as_recorded() -> None:
    world = world_of("arms-to-mavlink-at-57600.uart")
    world.run(world.naze.duration_s)
    assert [event.facts["protocol"] for event in world.events("fc.found")] == ["MSP", "MAVLink", "MSP"]
    assert [event.facts["speed_baud"] for event in world.events("fc.found")] == [115200, 57600, 115200]
    assert len(world.events("vehicle.armed")) == len(world.events("vehicle.disarmed")) == 1


def test_the_port_is_lost_and_the_power_cut_as_recorded() -> None:
    world = world_of("unplugged-then-no-power.uart")
    world.run(world.naze.duration_s)
    assert len(world.events("fc.found")) == 3
    assert len(world.events("fc.port_lost")) == 1
    assert len(world.events("fc.lost")) == 1


@pytest.mark.parametrize("when", [0.0, 1.0, 2.0, 9.0])
def test_a_mission_is_verified_over_the_recorded_line_whenever_it_is_sent(when: float) -> None:
    """With the recorded damage and losses: requests repeated then are repeated now."""
    world = world_of("mission-over-a-bad-line.uart")
    world.run(when)
    world.wait_ready()
    outcome = world.push(read_mission_file(MISSION.read_bytes(), MISSION.name))
    world.wait_until(lambda _: bool(outcome), 20)
    assert outcome[0][0].ack is MissionResult.ACCEPTED
    assert world.store.outcomes() == [Outcome.VERIFIED]


def test_a_mission_other_than_the_recorded_one_is_not_verified() -> None:
    world = world_of("mission-over-a-bad-line.uart")
    world.wait_ready()
    outcome = world.push(read_mission_file(MISSION.read_bytes(), MISSION.name)[:6])
    world.wait_until(lambda _: bool(outcome), 60)
    assert outcome[0][0].ack is not MissionResult.ACCEPTED


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(NAMES), st.data())
def test_a_damaged_capture_does_not_stop_the_bridge(name: str, data: st.DataObject) -> None:
    """With lines missing and out of order."""
    lines = (CAPTURES / name).read_bytes().splitlines(keepends=True)
    begin = data.draw(st.integers(0, len(lines) - 100))
    part = [line for line in lines[begin : begin + 400] if data.draw(st.integers(0, 9))]
    at = data.draw(st.integers(0, len(part)))
    player = CapturePlayer(read_capture(b"".join(part[at:] + part[:at])))
    world = World(peer=player)
    world.run(player.duration_s + 5)
    assert not isinstance(world.inside.session.state, Closed)
