# SPDX-License-Identifier: GPL-3.0-or-later
"""The telemetry streams that have values in the real MAVSDK."""

import asyncio
import math
from typing import Any

from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync

from tests.e2e.test_mavsdk import vehicle_at
from tests.support.benches import Bench
from tests.support.programs import until_async

#: The streams with values from a Harakiri, at the default rates.
EXPECTED = {
    "armed", "attitude_euler", "battery", "fixedwing_metrics", "flight_mode", "gps_info", "heading", "health",
    "health_all_ok", "home", "in_air", "landed_state", "position", "raw_gps", "rc_status", "unix_epoch_time",
    "velocity_ned", "vtol_state",
}  # fmt: skip
_PREFIX = "subscribe_"
#: Further wait for streams that should have no values, once all others have some.
_SILENCE_S = 3.0


def is_value(sample: Any) -> bool:
    """False if every number in a sample is NaN."""
    numbers = [value for value in getattr(sample, "__dict__", {}).values() if isinstance(value, float)]
    return not numbers or any(map(math.isfinite, numbers))


async def streams_with_values(vehicle: Any, expected: set[str]) -> set[str]:
    telemetry = TelemetryAsync(vehicle)
    found: set[str] = set()

    async def listen(name: str) -> None:
        async for sample in getattr(telemetry, _PREFIX + name)():
            if is_value(sample):
                found.add(name)
                return

    names = [name.removeprefix(_PREFIX) for name in dir(TelemetryAsync) if name.startswith(_PREFIX)]
    listeners = [asyncio.ensure_future(listen(name)) for name in names]
    await until_async(lambda: expected <= found, "a value of each stream")
    await asyncio.sleep(_SILENCE_S)
    for listener in listeners:
        listener.cancel()
    await asyncio.gather(*listeners, return_exceptions=True)
    return found


async def test_the_usual_telemetry_streams_have_values(shared: Bench) -> None:
    async with vehicle_at(shared.daemon.port) as vehicle:
        assert await streams_with_values(vehicle, EXPECTED) == EXPECTED
