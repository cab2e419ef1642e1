# SPDX-License-Identifier: GPL-3.0-or-later
"""A Harakiri armed with tele_prot 1 answers MSP between FrSky frames; both share one send ring."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mission_item import MissionResult
from simulator.board.options import SimOptions, TelemetryProtocol
from tests.support.conversations import Upload, waypoints
from tests.support.world import GroundStation, World


@pytest.mark.parametrize("after_s", [0.0, 0.031, 0.062, 0.093])
def test_reading_a_stored_list_does_not_overflow_the_send_ring(after_s: float) -> None:
    world = World(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600))
    world.wait_ready()
    station = GroundStation(world)
    assert Upload(station, waypoints(60)).run() is MissionResult.ACCEPTED
    station.send(messages.MAVLink_command_long_message(1, 1, 511, 0, 30, 10000, 0, 0, 0, 0, 0))
    for _ in range(4):
        world.run(after_s)
        world.faults.armed = True
        world.run(6)
        assert world.inside.session.state.speed == 9600
        assert world.naze.counters.tx_overflows == 0
        world.faults.armed = False
        world.run(5)
    world.assert_line_was_clean()
