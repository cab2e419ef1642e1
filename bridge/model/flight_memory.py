# SPDX-License-Identifier: GPL-3.0-or-later
"""The facts that a bridge restarted in flight needs, because an armed flight controller may not report them.

A Harakiri that speaks MAVLink or FrSky reports neither home nor the switch ranges that make its flight mode.
"""

from dataclasses import dataclass

from bridge.model.airframe import Airframe
from bridge.model.flight_mode import FlightMode


@dataclass(frozen=True, slots=True)
class Home:
    """Degrees * 1e7; altitude_m above mean sea level."""

    lat_e7: int
    lon_e7: int
    altitude_m: float | None = None


@dataclass(frozen=True, slots=True)
class FlightMemory:
    """An armed craft. Times are monotonic seconds, valid until the computer restarts.

    family: of the flight controller, as in Profile. armed_at: when it was armed, or first heard armed. mode: when the
    memory was made. boxes, activation: as in Switches. cells: of the battery.
    """

    family: str
    armed_at: float
    made_at: float
    mode: FlightMode | None
    home: Home | None
    boxes: tuple[str, ...]
    activation: tuple[int, ...]
    airframe: Airframe
    version: tuple[int, int, int] | None
    cells: int
