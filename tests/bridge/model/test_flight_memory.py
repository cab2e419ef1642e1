# SPDX-License-Identifier: GPL-3.0-or-later
"""A bridge that restarts in flight continues seamlessly, as long as the board does not contradict its memory."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.board import SimulatedNaze
from tests.support.fake_controllers import DeafWhileArmed
from tests.support.screens import Screens
from tests.support.world import GroundStation, World

BARO_AND_ANGLE = 0b101
GPS_HOLD = 1 << 7
PROTOCOLS = [TelemetryProtocol.MSP, TelemetryProtocol.MAVLINK_57600, TelemetryProtocol.FRSKY_9600]


def flying(protocol: TelemetryProtocol, boxes: int = BARO_AND_ANGLE) -> tuple[World, GroundStation, Screens]:
    """A craft armed 30 s ago, 25 m and more from where it was armed."""
    faults = Faults(boxes=boxes)
    board = DeafWhileArmed if protocol is TelemetryProtocol.FRSKY_9600 else SimulatedNaze
    world = World(faults=faults, peer=board(SimOptions(tele_prot=protocol), faults))
    world.wait_ready()
    station = GroundStation(world)
    connect(station)
    world.run(3)
    faults.armed = True
    world.run(30)
    return world, station, Screens(station)


def connect(station: GroundStation) -> None:
    def beat() -> None:
        station.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, 8, 0, 0, 0, 3))
        station.world.after(1.0, beat)

    beat()


def home(station: GroundStation) -> tuple[int, int, int]:
    (*_, last) = station.messages("HOME_POSITION")
    return last.latitude, last.longitude, last.altitude


@pytest.mark.parametrize("boxes", [BARO_AND_ANGLE, GPS_HOLD], ids=["AltHold", "Loiter"])
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_mode_arming_and_home_stay_as_they_are(protocol: TelemetryProtocol, boxes: int) -> None:
    world, station, screens = flying(protocol, boxes)
    before, placed = screens.glance(), home(station)
    assert before.armed
    assert before.mode == ("AltHold" if boxes == BARO_AND_ANGLE else "Loiter")
    restarted_at = world.now
    world.restart_bridge()
    for glance in screens.look(2.0, 3.0, 5.0, 9.0, 30.0):
        assert (glance.armed, glance.mode, glance.failsafe) == (True, before.mode, False)
    assert set(screens.mission_planner.armed.values(restarted_at)) <= {True}
    assert set(screens.mission_planner.mode.values(restarted_at)) <= {before.mode}
    assert home(station) == placed
    assert world.bridge.vehicle.home == world.flight.home  # type: ignore[union-attr]


def test_without_memory_the_mode_is_a_guess() -> None:
    """The board reports neither its switch ranges nor home."""
    world, _, screens = flying(TelemetryProtocol.MAVLINK_57600, GPS_HOLD)
    world.restart_bridge(flight=False)
    assert screens.look(10.0)[0].mode == "Acro"
    assert world.bridge.vehicle.home is None


def test_a_landing_that_nobody_saw_ends_the_flight() -> None:
    world, station, screens = flying(TelemetryProtocol.MAVLINK_57600)
    placed = home(station)
    world.at(world.now + 1.0, lambda: setattr(world.faults, "armed", False))
    world.restart_bridge(20.0)
    world.wait_ready()
    world.run(8)
    assert not screens.glance().armed
    assert world.flight is None
    assert home(station)[:2] != placed[:2]


def test_a_board_that_was_restarted_and_armed_again_is_another_flight() -> None:
    world, _, _ = flying(TelemetryProtocol.MAVLINK_57600)
    before = world.flight
    world.power_off()
    world.faults.armed = False
    world.naze.power_on(world.now)
    world.at(world.now + 10.0, lambda: setattr(world.faults, "armed", True))
    world.restart_bridge(20.0)
    world.run(10)
    after = world.flight
    assert before is not None
    assert after is not None
    assert after.armed_at > before.armed_at + 20
    assert after.home is None


def test_the_memory_is_made_on_arming_and_ends_on_disarming() -> None:
    world, _, _ = flying(TelemetryProtocol.MAVLINK_57600)
    memories = {id(world.flight)}
    for _ in range(60):
        world.run(1)
        memories.add(id(world.flight))
    assert len(memories) == 1
    world.faults.armed = False
    world.run(10)
    assert world.flight is None


def test_a_craft_that_is_not_found_again_is_lost() -> None:
    world, _, screens = flying(TelemetryProtocol.MAVLINK_57600)
    world.power_off()
    world.restart_bridge()
    (glance,) = screens.look(10.0)
    assert (glance.armed, glance.failsafe) == (True, True)
    assert any("Flight controller lost" in text for text in screens.mission_planner.texts(world.now - 10))
