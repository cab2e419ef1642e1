# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry from MSP polls: the messages match the craft, and the line is not overloaded."""

import math
from collections import Counter
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.dialect import Message
from protocols.msp.commands import Msp
from protocols.msp.frame import MspParser
from simulator.board.flight import FlightState
from simulator.board.options import Faults, SimOptions
from tests.bridge.vehicle.test_vehicle_messages import battery_mv
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
    return Counter(frame.command for _, _, data in world.written for frame in MspParser().feed(data))


def rate_hz(station: GroundStation, name: str, seconds: float) -> float:
    return len(station.messages(name)) / seconds


# The messages match the craft.


def test_a_flown_circle_is_shown_correctly() -> None:
    world, station = flown(3)
    truths: list[tuple[Message, FlightState]] = []

    def note(message: Message) -> None:
        truth = world.naze.truth(world.now)
        truths.append((message, truth.flight))

    station.on_message.append(note)
    world.run(60)
    seen: Counter[str] = Counter()
    for message, truth in truths:
        seen[message.get_type()] += 1
        check_against(message, truth)
    assert set(seen) >= {"ATTITUDE", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "VFR_HUD", "SYS_STATUS", "BATTERY_STATUS"}


def check_against(message: Message, truth: FlightState) -> None:
    """Tolerances: MSP's rounding, and values up to 0.2 s old, which is 50 cm at 2.5 m/s."""
    match message.get_type():
        case "ATTITUDE":
            assert math.degrees(message.roll) == pytest.approx(truth.roll, abs=0.2)
            assert math.degrees(message.pitch) == pytest.approx(-truth.pitch, abs=0.2)
            assert angle_between(math.degrees(message.yaw), truth.heading) <= 1
            assert math.isnan(message.rollspeed)
        case "GPS_RAW_INT":
            assert metres_between(message, truth) <= 0.1
            assert message.alt == pytest.approx(truth.altitude_m * 1000, abs=600)
            assert message.vel == pytest.approx(truth.speed_ms * 100, abs=1)
            assert angle_between(message.cog / 100, truth.course) <= 6
            assert (message.fix_type, message.satellites_visible, message.eph, message.epv) == (3, 9, 65535, 65535)
        case "GLOBAL_POSITION_INT":
            assert metres_between(message, truth) <= 0.1
            assert message.relative_alt == pytest.approx(truth.height_m * 1000, abs=500)
            assert math.hypot(message.vx, message.vy) == pytest.approx(truth.speed_ms * 100, abs=2)
            assert angle_between(math.degrees(math.atan2(message.vy, message.vx)), truth.course) <= 6
            assert message.vz == pytest.approx(-truth.climb_ms * 100, abs=10)
            assert angle_between(message.hdg / 100, truth.heading) <= 2
        case "VFR_HUD":
            assert message.groundspeed == message.airspeed == pytest.approx(truth.speed_ms, abs=0.01)
            assert message.climb == pytest.approx(truth.climb_ms, abs=0.05)
            assert message.alt == pytest.approx(truth.altitude_m, abs=1.1)
            assert angle_between(message.heading, truth.heading) <= 2
            assert message.throttle == 45
        case "SYS_STATUS" | "BATTERY_STATUS":
            millivolts = battery_mv(message) if message.get_type() == "BATTERY_STATUS" else message.voltage_battery
            assert millivolts == pytest.approx(truth.volts * 1000, abs=60)
            assert message.current_battery == -1
            assert 60 <= message.battery_remaining <= 100


def metres_between(message: Message, truth: FlightState) -> float:
    north = (message.lat - truth.lat_e7) * 0.01113
    east = (message.lon - truth.lon_e7) * 0.01113 * math.cos(math.radians(45.4))
    return math.hypot(north, east)


def angle_between(degrees: float, others: float) -> float:
    return abs((degrees - others + 180) % 360 - 180)


def test_the_sticks_are_in_arducopters_order() -> None:
    _, station = flown(5)
    (channels,) = station.messages("RC_CHANNELS")[-1:]
    assert channels.chancount == 8
    assert [getattr(channels, f"chan{number}_raw") for number in range(1, 9)] == [
        1500,
        1500,
        1450,
        1500,
        2000,
        1500,
        1000,
        1000,
    ]
    assert {getattr(channels, f"chan{number}_raw") for number in range(9, 19)} == {0}
    assert channels.rssi == 920 * 254 // 1020


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
