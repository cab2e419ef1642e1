# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller sends FrSky telemetry."""

from bridge.fc.autosense import Spoken
from bridge.fc.profile import FlightController
from bridge.fc.states.base import State
from bridge.fc.states.events import Event, FrskyFound, Lost
from bridge.fc.states.port import Port
from bridge.line.frsky_line import FrskyLine
from bridge.model.vehicle import FlightState, Source


class Frsky(State):
    """An armed Harakiri sends FrSky telemetry (tele_prot 1): nothing to read, so its end is waited for."""

    name = "FrSky"
    controller: FlightController

    def __init__(self, port: Port, event: FrskyFound, now: float) -> None:
        super().__init__(port, event.found.speed)
        (profile,) = (profile for profile in port.profiles if profile.spoken is Spoken.FRSKY)
        self.controller = FlightController(profile, profile.name)
        self._line = FrskyLine(now)
        port.meet(self.controller)
        self._note_armed(now)

    def receive(self, data: bytes, now: float) -> Event | None:
        """Watch the line."""
        if self._line.receive(data, now):
            self._note_armed(now)
        return None

    def _note_armed(self, now: float) -> None:
        """Only an armed Harakiri sends FrSky telemetry."""
        known = self.port.vehicle.last(FlightState)
        self.port.vehicle.hear(FlightState(now, Source.FRSKY, True, None if known is None else known.mode))

    def tick(self, now: float) -> Event | None:
        """Notice silence."""
        self._line.tick(now)
        return Lost(self._line.ended) if self._line.ended else None

    def deadline(self) -> float:
        """The end of the line's silence."""
        return self._line.next_deadline()
