# SPDX-License-Identifier: GPL-3.0-or-later
"""A damaged frame decides for the wrong flight controller; its steady heartbeats correct that."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers import other
from bridge.controllers.harakiri import profile as harakiri
from protocols.mavlink.dialect import Message
from simulator.board.options import Faults
from simulator.naze.board import SimulatedNaze
from tests.bridge.fc.states.test_pass_through import Autopilot
from tests.support.conversations import Upload, waypoints
from tests.support.corrupting_board import CorruptingBoard
from tests.support.fuzz_inputs import FuzzInputs
from tests.support.world import GroundStation, World

HARAKIRI, AUTOPILOT = (1, 200), (1, 1)


def heartbeat(sender: tuple[int, int], version: int, autopilot: int = 3) -> bytes:
    message: Message = messages.MAVLink_heartbeat_message(2, autopilot, 81, 0, 3, 3)
    codec = messages.MAVLink(None, srcSystem=sender[0], srcComponent=sender[1])
    return bytes(message.pack(codec, force_mavlink1=version == 1))


def silent_harakiri() -> SimulatedNaze:
    """It answers no MSP, and sends a heartbeat a second."""
    return SimulatedNaze(None, Faults(extension=False, msp=False))


def found_as_another(peer: SimulatedNaze) -> World:
    world = World(peer=peer, faults=peer.faults, speeds=(115200,))
    world.receive_from_fc(heartbeat(AUTOPILOT, 2))
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 5)
    return world


def test_a_harakiri_mistaken_for_another_autopilot() -> None:
    world = found_as_another(silent_harakiri())
    station = GroundStation(world)
    world.bridge.add_default_peer(station.peer)
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 10)
    world.run(60)
    assert world.kind is harakiri.MAVLINK
    assert len(station.messages("HEARTBEAT")) > 50
    assert Upload(station, waypoints(5)).run() == messages.MAV_MISSION_ACCEPTED
    world.assert_line_was_clean()


def test_a_harakiri_mistaken_for_another_autopilot_answers_msp_again() -> None:
    peer = silent_harakiri()
    world = found_as_another(peer)
    peer.faults.msp = True
    world.wait_until(lambda w: w.kind is harakiri.UNPATCHED, 15)


@pytest.mark.parametrize("seed", range(4))
def test_corrupted_frames_during_the_search(seed: int) -> None:
    """Valid checksums around wrong contents, also of foreign senders, until the board is found."""
    inputs = FuzzInputs(seed)
    board = CorruptingBoard(silent_harakiri(), inputs, 0.5)
    world = World(peer=board, speeds=(115200,))

    def corrupt() -> None:
        sender = inputs.random.choice((AUTOPILOT, HARAKIRI, (7, 200), (1, 0)))
        world.receive_from_fc(heartbeat(sender, inputs.random.choice((1, 2)), inputs.random.randrange(9)))

    for _ in range(10):
        corrupt()
        world.run(0.4)
    board._rate = 0.0
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 10)
    world.run(60)
    assert world.kind is harakiri.MAVLINK


def test_another_autopilot_mistaken_for_a_harakiri() -> None:
    autopilot = Autopilot()
    world = World(peer=autopilot, speeds=(115200,))
    world.receive_from_fc(heartbeat(HARAKIRI, 1))
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 5)
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 10)
    station = GroundStation(world)
    station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    station.frames.clear()
    autopilot.sent.clear()
    world.run(20)
    assert station.frames == autopilot.sent != []
    assert world.kind is other.OTHER_MAVLINK


@pytest.mark.parametrize("kind", [3, 8], ids=["autopilot", "sensor"])
def test_a_second_component_beside_an_autopilot_changes_nothing(kind: int) -> None:
    """Component 200 is also MAVLink's id of a gyro. The autopilot's own heartbeats come less often."""
    world = World(peer=Autopilot(), speeds=(115200,))
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 5)
    for _ in range(240):
        world.receive_from_fc(heartbeat(HARAKIRI, 1, kind))
        world.run(0.1 if kind == 3 else 0.4)
        assert world.kind is other.OTHER_MAVLINK
    assert world.events("fc.lost") == []


def test_a_sensor_that_outlives_its_autopilot_is_not_a_harakiri() -> None:
    autopilot = Autopilot()
    world = World(peer=autopilot, speeds=(115200,))
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 5)
    autopilot._due = 1e9
    for _ in range(60):
        world.receive_from_fc(heartbeat(HARAKIRI, 1, messages.MAV_AUTOPILOT_INVALID))
        world.run(0.5)
    assert world.kind is other.OTHER_MAVLINK
