# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicle that ground stations see: modes and arming at once, home, no false alarms."""

import pytest

from protocols.msp.nav import NavAction, NavMode, NavState
from simulator.board.options import Faults, SimOptions, Tree
from tests.bridge.fc.test_msp_telemetry import flown, listening, m
from tests.bridge.vehicle.test_item_numbers import bench
from tests.support.world import GroundStation, World, ready_world

ANGLE, BARO, GPS_HOME, GPS_HOLD, GPS_AUTO = 1 << 0, 1 << 2, 1 << 6, 1 << 7, 1 << 8


def test_no_ground_station_shows_a_false_alarm() -> None:
    """MAVProxy shows "fence breach" without the fence bit, Mission Planner "SAFE" without the motor bit."""
    _, station = flown(3)
    status = station.messages("SYS_STATUS")[-1]
    present, health = status.onboard_control_sensors_present, status.onboard_control_sensors_health
    assert present == status.onboard_control_sensors_enabled
    assert health & present == present
    assert present & m.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    assert health & m.MAV_SYS_STATUS_GEOFENCE
    assert not present & m.MAV_SYS_STATUS_GEOFENCE
    for bit in ("RC_RECEIVER", "3D_GYRO", "3D_ACCEL", "3D_MAG", "ABSOLUTE_PRESSURE", "GPS"):
        assert present & getattr(m, f"MAV_SYS_STATUS_SENSOR_{bit}")
    assert status.errors_count1 == status.errors_count2 == 0  # Mission Planner: "InternalError"


@pytest.mark.parametrize(
    ("boxes", "custom_mode", "stabilized"),
    [
        (0, 1, False),
        (ANGLE, 0, True),
        (1 << 1, 0, True),
        (ANGLE | BARO, 2, True),
        (ANGLE | BARO | GPS_HOLD, 5, True),
        (ANGLE | BARO | GPS_HOME, 6, True),
        # The switch alone flies no mission.
        (ANGLE | BARO | GPS_AUTO | GPS_HOLD, 5, True),
        (1 << 9 | 1 << 3, 1, False),
    ],
)
def test_the_switches_determine_the_mode(boxes: int, custom_mode: int, stabilized: bool) -> None:
    _, station = flown(1.5, faults=Faults(boxes=boxes))
    send_heartbeat = station.messages("HEARTBEAT")[-1]
    assert send_heartbeat.custom_mode == custom_mode
    assert bool(send_heartbeat.base_mode & m.MAV_MODE_FLAG_STABILIZE_ENABLED) is stabilized
    assert send_heartbeat.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED


@pytest.mark.parametrize(("switch", "position"), [("armed", False), ("boxes", 5)])
def test_arming_and_modes_are_reported_at_once(switch: str, position: int) -> None:
    world, station = flown(5.2)
    station.take()
    setattr(world.faults, switch, position)
    world.run(0.3)
    heartbeat = station.messages("HEARTBEAT")[-1]
    assert heartbeat.custom_mode == (2 if switch == "boxes" else 0)
    assert bool(heartbeat.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED) is (switch == "boxes")


def test_a_heartbeat_is_sent_with_a_poll() -> None:
    """It needs no wake-up of its own: polls are due at whole seconds, whenever the bridge started."""
    world = World()
    world.restart_bridge(away_s=2.345)
    world.wait_ready()
    station = listening(world)
    world.run(10)
    times = [at for at, message in station.received if message.get_type() == "HEARTBEAT"][-5:]
    polled = {round(at, 2) for at, _, _ in world.written}
    assert polled.issuperset(round(at, 2) for at in times)


@pytest.mark.parametrize("tree", Tree)
def test_home_before_arming_is_the_position(tree: Tree) -> None:
    """HarakiriWebstore1 reports an unknown home as 190 degrees, TestCode3 as 0."""
    world = ready_world(SimOptions(tree=tree))
    station = listening(world)
    world.run(3)
    home = station.messages("HOME_POSITION")[-1]
    assert (home.latitude, home.longitude) == (453838000, 84733000)


def test_an_emergency_landing_of_an_inav_is_reported_once() -> None:
    world, board = bench()
    station = GroundStation(world).stay_connected()
    board.armed = True
    for state in (NavState.RTH_ENROUTE, NavState.EMERGENCY_LANDING, NavState.EMERGENCY_LANDING):
        board.nav = (NavMode.RTH, state, NavAction.RTH, 1, 0, 0)
        world.run(2.5)
    (text,) = [text for text in station.messages("STATUSTEXT") if text.severity == m.MAV_SEVERITY_CRITICAL]
    assert text.text == "EMERGENCY LANDING"
