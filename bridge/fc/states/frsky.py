# SPDX-License-Identifier: GPL-3.0-or-later
"""An armed Harakiri sends FrSky telemetry, which has no checksum and few values."""

from bridge.fc.profile import FlightController, Spoken
from bridge.fc.states.base import Event, Found, Lost, Port, State
from bridge.line.msp_link import PROBE
from bridge.model.craft import Home
from bridge.model.ground_track import north_east_m
from bridge.model.vehicle import STALE_S, GlobalPosition, Health, Height, Orientation, Power, Source, Vehicle
from protocols.frsky import FRSKY_SPEED, FrskyParser, FrskyReport
from protocols.msp.frame import MspParser
from protocols.msp.telemetry import Sensor

#: Harakiri sends eight times a second.
_SILENCE_S = 1.0
#: A Harakiri that receives requests also answers MSP, which has more values.
_PROBE_INTERVAL_S = 5.0
#: Reports that arrive together were sent at different times.
_SHORTEST_S = 0.2
#: No craft with a Naze32 flies or climbs faster.
_FASTEST_M_S, _FASTEST_CLIMB_M_S = 100.0, 50.0


class Frsky(State):
    """An armed Harakiri sends FrSky telemetry (tele_prot 1) and did not answer MSP."""

    name = "FrSky"
    controller: FlightController

    def __init__(self, port: Port, event: Found, now: float) -> None:
        super().__init__(port, event, now)
        (profile,) = (profile for profile in port.profiles if profile.spoken is Spoken.FRSKY)
        self.controller = FlightController(profile, profile.name)
        self._parser, self._msp = FrskyParser(), MspParser()
        self._probe_due = now + _PROBE_INTERVAL_S
        port.meet(self.controller)
        self._telemetry = FrskyTelemetry(port.vehicle)
        self._note_armed(now)

    def receive(self, data: bytes, now: float) -> Event | None:
        for report in self._parser.feed(data):
            self._telemetry.take(report, now)
        if self._parser.values_in_a_row:
            self._note_armed(now)
        return Lost("it answers MSP again", (FRSKY_SPEED,)) if self._msp.feed(data) else None

    def _note_armed(self, now: float) -> None:
        """Only an armed Harakiri sends FrSky telemetry."""
        self._heard_at = now
        self.port.hear_armed(Source.FRSKY, now)

    def tick(self, now: float) -> Event | None:
        if now >= self._probe_due:
            self._probe_due = now + _PROBE_INTERVAL_S
            self.port.output.append(PROBE)
        return Lost(f"no FrSky telemetry for {_SILENCE_S} s") if now >= self._heard_at + _SILENCE_S else None

    @property
    def due(self) -> float:
        return min(self._probe_due, self._heard_at + _SILENCE_S)


class FrskyTelemetry:
    """Fills a vehicle. Values that FrSky does not carry keep their last reading, which becomes stale.

    Climb and velocity follow from successive reports. A report that jumps counts as damaged. After its GPS has lost its
    fix, Harakiri keeps sending the last position without saying so: a position counts only while it moves.
    """

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
