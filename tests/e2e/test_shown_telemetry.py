# SPDX-License-Identifier: GPL-3.0-or-later
"""The real MAVSDK and DroneKit show a flown circle like the simulated craft flew it.

Polls, the ground station's own rate and this process delay a value by half a second at most. The craft flies at
2.5 m/s on a circle of 25 m (6 degrees a second) and initially climbs at 2.5 m/s. The tolerances are its motion
during that delay and MSP's rounding.
"""

import asyncio
import json
import math
from collections.abc import AsyncIterator, Callable
from functools import partial
from typing import Any

import pytest
from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync

from bridge.model.craft import remaining_percent
from simulator.board.flight import FIELD_LAT_E7, METRES_PER_DEGREE
from tests.e2e.test_mavsdk import vehicle_at
from tests.support import dronekit
from tests.support.benches import Bench
from tests.support.programs import TIMEOUT_S, happens

POSITION_M = 1.5
HEIGHT_M = 1.0
DIRECTION_DEG = 6.0
TILT_DEG = 1.0
SPEED_MS = 0.1
VOLTAGE_V = 0.1
#: Remaining charge is estimated from the voltage of three cells; the tolerance is VOLTAGE_V on the steepest part of the
#: discharge curve.
CELLS = 3
REMAINING_PERCENT = 9
#: Mode by active box.
MAVSDK_MODES = {
    1 << 0: "STABILIZED",
    1 << 2: "ALTCTL",
    1 << 7: "HOLD",
    1 << 6: "RETURN_TO_LAUNCH",
    0: "ACRO",
}


def truth(bench: Bench) -> dict[str, Any]:
    """The craft's true state: the fields of FlightState."""
    craft = json.loads(bench.board.line("truth"))
    flight: dict[str, Any] = craft["flight"]
    return flight


def metres_from(flight: dict[str, Any], lat_deg: float, lon_deg: float) -> float:
    north = (lat_deg - flight["lat_e7"] / 1e7) * METRES_PER_DEGREE
    east = (lon_deg - flight["lon_e7"] / 1e7) * METRES_PER_DEGREE * math.cos(math.radians(lat_deg))
    return math.hypot(north, east)


def degrees_between(one: float, other: float) -> float:
    return abs((one - other + 180) % 360 - 180)


async def agrees(values: AsyncIterator[Any], check: Callable[[Any], None], times: int = 10) -> None:
    """Check values until `times` in a row pass: the first ones may be from before the flight."""
    agreed, failure = 0, None
    try:
        async with asyncio.timeout(TIMEOUT_S):
            async for value in values:
                try:
                    check(value)
                except AssertionError as error:
                    agreed, failure = 0, error
                else:
                    agreed += 1
                if agreed >= times:
                    return
    except TimeoutError:
        raise failure or AssertionError(f"no value for {check.__name__}") from None


async def test_mavsdk_shows_the_flight_correctly(bench: Bench) -> None:
    bench.board.set("armed 1")
    async with vehicle_at(bench.daemon.port) as vehicle:
        telemetry = TelemetryAsync(vehicle)

        def position(shown: Any) -> None:
            now = truth(bench)
            assert metres_from(now, shown.latitude_deg, shown.longitude_deg) <= POSITION_M
            assert shown.relative_altitude_m == pytest.approx(now["height_m"], abs=HEIGHT_M)
            assert shown.absolute_altitude_m == pytest.approx(now["altitude_m"], abs=HEIGHT_M + 0.5)

        def attitude(shown: Any) -> None:
            now = truth(bench)
            assert shown.roll_deg == pytest.approx(now["roll"], abs=TILT_DEG)
            assert shown.pitch_deg == pytest.approx(-now["pitch"], abs=TILT_DEG)
            assert degrees_between(shown.yaw_deg, now["heading"]) <= DIRECTION_DEG

        def velocity(shown: Any) -> None:
            now = truth(bench)
            assert math.hypot(shown.north_m_s, shown.east_m_s) == pytest.approx(now["speed_ms"], abs=SPEED_MS)
            course = math.degrees(math.atan2(shown.east_m_s, shown.north_m_s))
            assert degrees_between(course, now["course"]) <= DIRECTION_DEG
            assert shown.down_m_s == pytest.approx(-now["climb_ms"], abs=0.3)

        def battery(shown: Any) -> None:
            volts = truth(bench)["volts"]
            assert shown.voltage_v == pytest.approx(volts, abs=VOLTAGE_V)
            assert shown.remaining_percent == pytest.approx(remaining_percent(volts, CELLS), abs=REMAINING_PERCENT)

        def gps(shown: Any) -> None:
            assert (shown.num_satellites, shown.fix_type) == (9, 3)

        def home(shown: Any) -> None:
            start = (453838000 / 1e7, 84733000 / 1e7)
            assert (shown.latitude_deg, shown.longitude_deg) == pytest.approx(start, abs=1e-6)
            assert shown.absolute_altitude_m == pytest.approx(131, abs=1)

        await agrees(telemetry.subscribe_position(), position)
        await agrees(telemetry.subscribe_attitude_euler(), attitude)
        await agrees(telemetry.subscribe_velocity_ned(), velocity)
        await agrees(telemetry.subscribe_battery(), battery, times=3)
        await agrees(telemetry.subscribe_gps_info(), gps, times=3)
        await telemetry.set_rate_home(1.0)
        await agrees(telemetry.subscribe_home(), home, times=1)
        for boxes, name in MAVSDK_MODES.items():
            bench.board.set(f"boxes {boxes}")

            def mode(shown: Any, name: str = name) -> None:
                assert shown.name == name

            await agrees(telemetry.subscribe_flight_mode(), mode, times=1)


def shows_mode(vehicle: Any, name: str) -> bool:
    shown: str = vehicle.mode.name
    return shown == name


def test_dronekit_shows_the_flight_correctly(bench: Bench) -> None:
    bench.board.set("armed 1")
    with dronekit.vehicle_at(bench.daemon.port) as vehicle:
        assert vehicle.parameters["SYSID_THISMAV"] == 1
        assert (vehicle.gps_0.fix_type, vehicle.gps_0.satellites_visible) == (3, 9)
        for boxes, mode in ((1 << 7, "LOITER"), (1 << 6, "RTL"), (0, "ACRO")):
            bench.board.set(f"boxes {boxes}")
            assert happens(partial(shows_mode, vehicle, mode))
        assert (vehicle.armed, vehicle.system_status.state) == (True, "ACTIVE")

        def agrees_now() -> bool:
            place, local, now = vehicle.location.global_relative_frame, vehicle.location.local_frame, truth(bench)
            north_m = (now["lat_e7"] - FIELD_LAT_E7) / 1e7 * METRES_PER_DEGREE
            return (
                place.lat is not None
                and metres_from(now, place.lat, place.lon) <= POSITION_M
                and abs(place.alt - now["height_m"]) <= HEIGHT_M
                and local.north is not None
                and abs(local.north - north_m) <= POSITION_M
                and abs(math.degrees(vehicle.attitude.roll) - now["roll"]) <= TILT_DEG
                and abs(math.degrees(vehicle.attitude.pitch) + now["pitch"]) <= TILT_DEG
                and degrees_between(vehicle.heading, now["heading"]) <= DIRECTION_DEG
                and abs(math.hypot(*vehicle.velocity[:2]) - now["speed_ms"]) <= SPEED_MS
                and abs(vehicle.battery.voltage - now["volts"]) <= VOLTAGE_V
            )

        for _ in range(5):
            assert happens(agrees_now)
