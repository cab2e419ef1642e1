# SPDX-License-Identifier: GPL-3.0-or-later
"""A flight is logged from arming to disarming, with or without a ground station."""

from collections import Counter

import pytest
from pymavlink.dialects.v20 import all as m

from protocols.mavlink.frame import MavlinkSplitter
from simulator.board.options import SimOptions, TelemetryProtocol
from tests.support.world import GroundStation, World


def take(world: World) -> Counter[str]:
    """Messages logged since the last call, counted by name."""
    found = MavlinkSplitter().feed(b"".join(world.recorded))
    world.recorded.clear()
    return Counter(m.mavlink_map[frame.msgid].msgname for frame in found)


def logged(protocol: TelemetryProtocol) -> World:
    world = World(SimOptions(tele_prot=protocol), has_log=True)
    world.wait_ready(30)
    world.run(3)
    return world


@pytest.mark.parametrize("protocol", [TelemetryProtocol.MSP, TelemetryProtocol.MAVLINK])
def test_a_flight_without_a_ground_station_is_logged_at_full_rates(protocol: TelemetryProtocol) -> None:
    world = logged(protocol)
    assert take(world) == {}
    world.faults.armed = True
    world.run(5)
    take(world)
    world.run(10)
    flown = take(world)
    assert flown["ATTITUDE"] == pytest.approx(100, rel=0.1)
    assert flown["GLOBAL_POSITION_INT"] >= 20
    assert {"BATTERY_STATUS", "SYS_STATUS", "RC_CHANNELS", "VFR_HUD", "HEARTBEAT"} <= set(flown)
    world.faults.armed = False
    world.run(6)
    take(world)
    world.run(5)
    assert take(world) == {}


def test_low_requested_rates_do_not_slow_the_log() -> None:
    world = logged(TelemetryProtocol.MSP)
    station = GroundStation(world)
    station.send(m.MAVLink_request_data_stream_message(1, 1, 0, 1, 1))
    world.faults.armed = True
    world.run(5)
    take(world)
    station.take()
    world.run(10)
    assert len(station.messages("ATTITUDE")) == pytest.approx(10, abs=2)
    assert take(world)["ATTITUDE"] == pytest.approx(100, rel=0.1)
