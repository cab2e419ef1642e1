# SPDX-License-Identifier: GPL-3.0-or-later
"""Other components beside an autopilot do not change what it is."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers import other
from protocols.mavlink.dialect import Message
from tests.bridge.fc.states.test_pass_through import Autopilot
from tests.support.world import World

HARAKIRI, AUTOPILOT = (1, 200), (1, 1)


def heartbeat(sender: tuple[int, int], version: int, autopilot: int = 3) -> bytes:
    message: Message = messages.MAVLink_heartbeat_message(2, autopilot, 81, 0, 3, 3)
    codec = messages.MAVLink(None, srcSystem=sender[0], srcComponent=sender[1])
    return bytes(message.pack(codec, force_mavlink1=version == 1))


@pytest.mark.parametrize("kind", [3, 8], ids=["autopilot", "sensor"])
def test_a_second_component_of_an_autopilot_is_ignored(kind: int) -> None:
    """Component 200 is also MAVLink's id of a gyro. The autopilot's own heartbeats come less often."""
    world = World(peer=Autopilot(), speeds=(115200,))
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 5)
    for _ in range(240):
        world.receive_from_fc(heartbeat(HARAKIRI, 1, kind))
        world.run(0.1 if kind == 3 else 0.4)
        assert world.kind is other.OTHER_MAVLINK
    assert world.events("fc.lost") == []


def test_a_sensor_that_outlives_the_autopilot_is_not_a_harakiri() -> None:
    autopilot = Autopilot()
    world = World(peer=autopilot, speeds=(115200,))
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 5)
    autopilot._due = 1e9
    for _ in range(60):
        world.receive_from_fc(heartbeat(HARAKIRI, 1, messages.MAV_AUTOPILOT_INVALID))
        world.run(0.5)
    assert world.kind is other.OTHER_MAVLINK
