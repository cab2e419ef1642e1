# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller sends FrSky telemetry."""

from bridge.fc.frsky_telemetry import FrskyTelemetry
from bridge.fc.profile import FlightController, Spoken
from bridge.fc.states.base import Event, Found, Lost, Port, State
from bridge.line.msp_link import PROBE
from bridge.model.vehicle import Source
from protocols.frsky import FRSKY_SPEED, FrskyParser
from protocols.msp.frame import MspParser

#: Harakiri sends eight times a second.
_SILENCE_S = 1.0
#: A Harakiri that receives requests also answers MSP, which has more values.
_PROBE_INTERVAL_S = 5.0


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
