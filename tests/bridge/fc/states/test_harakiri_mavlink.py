# SPDX-License-Identifier: GPL-3.0-or-later
"""Arming changes protocol and speed (tele_prot 0..3) and disarming changes them back; stations see one vehicle."""

from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers import other
from bridge.controllers.harakiri import profile as harakiri
from bridge.line.msp_link import PROBE
from protocols.mission_item import MissionResult
from simulator.board.options import SimOptions, TelemetryProtocol
from tests.support.conversations import Upload, records_of, waypoints
from tests.support.fake_controllers import MavlinkOnly
from tests.support.world import GroundStation, World, ready_world

COPTER_STABILIZE = 0


def heartbeat_gaps(station: GroundStation) -> list[float]:
    times = [at for at, message in station.received if message.get_type() == "HEARTBEAT"]
    return [later - sooner for sooner, later in pairwise(times)]


def wait_for_telemetry(world: World, station: GroundStation, *, armed: bool) -> float:
    """Wait for a heartbeat with this armed state and an attitude; return the longest gap in ATTITUDE, s."""
    began = world.now
    longest, last = 0.0, began
    station.received.clear()
    while world.now < began + 8:
        world.run(0.1)
        times = [at for at, message in station.received if message.get_type() == "ATTITUDE"]
        longest = max([longest, *(later - sooner for sooner, later in pairwise([last, *times]))])
        beats = [message for message in station.messages("HEARTBEAT") if bool(message.base_mode & 128) is armed]
        if beats and times:
            break
    else:
        raise AssertionError("no telemetry")
    return longest


@pytest.mark.parametrize(("protocol", "baud"), [
    (TelemetryProtocol.MSP, 57600), (TelemetryProtocol.MAVLINK, 38400), (TelemetryProtocol.MAVLINK_57600, 115200),
    (TelemetryProtocol.MAVLINK_57600, 9600),
])  # fmt: skip
def test_ground_stations_see_one_vehicle(protocol: TelemetryProtocol, baud: int) -> None:
    world = World(SimOptions(baud=baud, tele_prot=protocol))
    station = GroundStation(world)
    world.bridge.add_default_peer(station.peer, until_answered=False)
    world.wait_ready()
    assert Upload(station, waypoints(12)).run() is MissionResult.ACCEPTED
    modes: set[int] = set()
    station.on_message.append(
        lambda message: modes.add(message.custom_mode) if message.get_type() == "HEARTBEAT" else None
    )
    for _ in range(2):
        for armed in (True, False):
            world.faults.armed = armed
            assert wait_for_telemetry(world, station, armed=armed) <= 3.0
            if armed:
                assert Upload(station, waypoints(13)).run() is MissionResult.DENIED
            world.run(5)
    assert world.stored == records_of(waypoints(12))
    assert max(heartbeat_gaps(station)) <= 1.5
    assert modes == {COPTER_STABILIZE}
    senders = {(message.get_srcSystem(), message.get_srcComponent()) for message in station.messages()}
    assert senders == {(1, 1)}
    assert not [text for text in station.texts() if "lost" in text or "Found" in text]
    names = [event.name for event in world.log_event if event.name.startswith("vehicle.")]
    assert names == ["vehicle.armed", "vehicle.disarmed"] * 2
    world.assert_line_was_clean()


def test_ground_stations_see_one_vehicle_while_frsky_is_sent() -> None:
    world = World(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600))
    station = GroundStation(world)
    world.bridge.add_default_peer(station.peer, until_answered=False)
    world.wait_ready()
    for _ in range(2):
        station.received.clear()
        world.faults.armed = True
        world.wait_until(lambda w: w.inside.session.state.speed == 9600 and w.kind is harakiri.PATCHED, 5, then_s=20)
        assert world.kind is harakiri.PATCHED
        assert station.messages("HEARTBEAT")[-1].base_mode & 128
        status = station.messages("SYS_STATUS")[-1]
        assert status.onboard_control_sensors_health & messages.MAV_SYS_STATUS_SENSOR_GPS
        assert world.now - next(at for at, message in reversed(station.received) if message is status) <= 1.1
        assert Upload(station, waypoints(13)).run() is MissionResult.DENIED
        world.faults.armed = False
        world.wait_until(lambda w: w.kind is harakiri.PATCHED and w.inside.session.state.speed == 115200, 5, then_s=3)
        assert max(heartbeat_gaps(station)) <= 1.5
        assert not [text for text in station.texts() if "lost" in text]
    world.assert_line_was_clean()


def test_a_board_met_over_msp_keeps_the_family_regardless_of_the_ids() -> None:
    """A Harakiri with changed ids: to pass frames on to it could reset it."""
    world = ready_world()
    world.naze = MavlinkOnly(1)
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 8, then_s=30)
    assert world.kind is harakiri.MAVLINK


def test_a_harakiri_that_disarms_is_asked_for_msp_at_once() -> None:
    world = ready_world(SimOptions(tele_prot=TelemetryProtocol.MAVLINK))
    world.faults.armed = True
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK and w.bridge.vehicle.armed is True, 8, then_s=3.3)
    world.faults.armed = False
    world.wait_until(lambda w: w.bridge.vehicle.armed is False, 5, then_s=0.01)
    assert PROBE in [data for at, _, data in world.written if at >= world.now - 0.02]


@pytest.mark.parametrize("version", [1, 2])
def test_another_autopilot_in_place_of_a_harakiri_is_not_mistaken_for_it(version: int) -> None:
    """It can be told apart without a new connection only if it sends MAVLink 2."""
    world = ready_world()
    if version == 1:
        world.unplug()
    world.naze = MavlinkOnly(version)
    if version == 1:
        world.plug()
    world.wait_until(lambda w: w.kind is other.OTHER_MAVLINK, 8)
