# SPDX-License-Identifier: GPL-3.0-or-later
"""The protocol and speed of a port are looked for."""

from bridge.fc.autosense import Autosense, Spoken
from bridge.fc.states.base import State
from bridge.fc.states.events import CliFound, Event, FrskyFound, Lost, MavlinkFound, MspFound
from bridge.fc.states.port import Port


class Searching(State):
    """The protocol and speed are looked for."""

    name = "searching"
    is_searching = True

    def __init__(self, port: Port, now: float, lost: Lost | None = None) -> None:
        first, pending = ((), None) if lost is None else (lost.first, lost.pending)
        self._search = Autosense(port.speeds, port.known_speed, now, first, pending)
        super().__init__(port, self._search.speed)

    def receive(self, data: bytes, now: float) -> Event | None:
        """Feed the search."""
        self._search.receive(data, now)
        return self._event()

    def tick(self, now: float) -> Event | None:
        """Move the search on."""
        self._search.tick(now)
        return self._event()

    def deadline(self) -> float:
        """A search always has a next step."""
        deadline = self._search.next_deadline()
        return 0.0 if deadline is None else deadline

    def take_output(self) -> list[bytes]:
        """The search's probes."""
        return super().take_output() + self._search.take_output()

    def _event(self) -> Event | None:
        self.speed = self._search.speed
        found = self._search.found
        if found is None:
            return None
        self.port.output += self._search.take_output()
        if found.spoken is Spoken.MSP or (self.port.known_speed is None and found.spoken is Spoken.MAVLINK):
            self.port.known_speed = found.speed
        match found.spoken:
            case Spoken.MSP:
                return MspFound(found, self._search.pending)
            case Spoken.MAVLINK:
                return MavlinkFound(found)
            case Spoken.FRSKY:
                return FrskyFound(found)
            case Spoken.CLI:
                return CliFound(found)
