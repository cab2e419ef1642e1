# SPDX-License-Identifier: GPL-3.0-or-later
"""A Harakiri that is armed with tele_prot 1 answers MSP beside its FrSky telemetry, out of one send ring."""

import pytest

from protocols.mavlink.dialect import messages
from protocols.mission_item import MissionResult
from simulator.options import SimOptions, TelemetryProtocol
from tests.support.conversations import Upload, waypoints
from tests.support.world import GroundStation, World


@pytest.mark.parametrize("after_s", [0.0, 0.031, 0.062, 0.093])
def test_the_ring_is_not_lapped_while_a_stored_list_is_read(after_s: float) -> None:
    world = World(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600))
    world.wait_ready()
    station = GroundStation(world)
    assert Upload(station, waypoints(60)).run() is MissionResult.ACCEPTED
    station.send(messages.MAVLink_command_long_message(1, 1, 511, 0, 30, 10000, 0, 0, 0, 0, 0))
    for _ in range(4):
        world.run(after_s)
        world.faults.armed = True
        world.run(6)
        assert world.bridge.session.speed == 9600
        assert world.naze.counters.tx_overflows == 0
        world.faults.armed = False
        world.run(5)
    world.assert_line_was_clean()
