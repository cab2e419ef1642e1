# SPDX-License-Identifier: GPL-3.0-or-later
"""Readings of the vehicle from Harakiri's FrSky telemetry, which has no checksum and few values.

Climb and velocity follow from successive reports. A report that jumps counts as damaged. After its GPS has lost
its fix, Harakiri keeps sending the last position without saying so: a position counts only while it moves.
"""

from bridge.model.flight_memory import Home
from bridge.model.ground_track import north_east_m
from bridge.model.vehicle import (
    STALE_S,
    GlobalPosition,
    Health,
    Height,
    Orientation,
    Power,
    Source,
    Vehicle,
)
from protocols.frsky import FrskyReport
from protocols.msp.telemetry import Sensor

#: Reports that arrive together were sent at different times.
_SHORTEST_S = 0.2
#: No craft with a Naze32 flies or climbs faster.
_FASTEST_M_S, _FASTEST_CLIMB_M_S = 100.0, 50.0


class FrskyTelemetry:
    """Fills a vehicle. Values that FrSky does not carry keep their last reading, which becomes stale."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._height: tuple[float, float] | None = None
        self._place: tuple[float, Home] | None = None

    def take(self, report: FrskyReport, now: float) -> None:
        if report.heading_deg is not None:
            health = self._vehicle.last(Health)
            has_compass = health is not None and Sensor.COMPASS in health.sensors
            self._vehicle.hear(Orientation(now, Source.FRSKY, None, None, float(report.heading_deg), has_compass))
        if report.height_m is not None:
            self._take_height(report.height_m, now)
        if report.voltage_v is not None:
            self._vehicle.hear(Power(now, Source.FRSKY, report.voltage_v))
        if report.place_e7 is not None:
            self._take_place(Home(*report.place_e7), now)

    def _take_height(self, height_m: float, now: float) -> None:
        before, self._height = self._height, (now, height_m)
        if before is None or not _SHORTEST_S <= now - before[0] <= STALE_S:
            return
        climb_m_s = (height_m - before[1]) / (now - before[0])
        if abs(climb_m_s) <= _FASTEST_CLIMB_M_S:
            self._vehicle.hear(Height(now, Source.FRSKY, height_m, climb_m_s))

    def _take_place(self, place: Home, now: float) -> None:
        before, self._place = self._place, (now, place)
        if before is None or not _SHORTEST_S <= now - before[0] <= STALE_S:
            return
        north_m_s, east_m_s = (metres / (now - before[0]) for metres in north_east_m(before[1], place))
        if place != before[1] and max(abs(north_m_s), abs(east_m_s)) <= _FASTEST_M_S:
            self._vehicle.hear(GlobalPosition(now, Source.FRSKY, place.lat_e7, place.lon_e7, None, north_m_s, east_m_s))
