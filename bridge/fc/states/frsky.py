# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller sends FrSky telemetry."""

from bridge.fc.autosense import Spoken
from bridge.fc.profile import FlightController
from bridge.fc.states.base import State
from bridge.fc.states.events import Event, FrskyFound, Lost
from bridge.fc.states.port import Port
from bridge.model.vehicle import FlightState, Source
from protocols.frsky import FrskyWatch

#: Harakiri sends eight times a second.
_SILENCE_S = 1.0


class Frsky(State):
    """An armed Harakiri sends FrSky telemetry (tele_prot 1): nothing to read, so its end is waited for."""

    name = "FrSky"
    controller: FlightController

    def __init__(self, port: Port, event: FrskyFound, now: float) -> None:
        super().__init__(port, event.found.speed)
        (profile,) = (profile for profile in port.profiles if profile.spoken is Spoken.FRSKY)
        self.controller = FlightController(profile, profile.name)
        self._watch = FrskyWatch()
        port.meet(self.controller)
        self._note_armed(now)

    def receive(self, data: bytes, now: float) -> Event | None:
        """Watch the line."""
        self._watch.feed(data)
        if self._watch.values_in_a_row:
            self._note_armed(now)
        return None

    def _note_armed(self, now: float) -> None:
        """Only an armed Harakiri sends FrSky telemetry."""
        self._heard_at = now
        known = self.port.vehicle.last(FlightState)
        self.port.vehicle.hear(FlightState(now, Source.FRSKY, True, None if known is None else known.mode))

    def tick(self, now: float) -> Event | None:
        """Notice silence."""
        return Lost(f"no FrSky telemetry for {_SILENCE_S} s") if now >= self.deadline() else None

    def deadline(self) -> float:
        """The end of the line's silence."""
        return self._heard_at + _SILENCE_S
