# SPDX-License-Identifier: GPL-3.0-or-later
"""Searches for the protocol and speed of a port."""

from bridge.fc.autosense import Autosense
from bridge.fc.states.base import Event, Lost, Port, PortOpened, State


class Searching(State):
    """The protocol and speed are being searched for."""

    name = "searching"
    is_searching = True

    def __init__(self, port: Port, event: PortOpened | Lost, now: float) -> None:
        super().__init__(port, event, now)
        first, pending = (event.first, event.pending) if isinstance(event, Lost) else ((), None)
        first = [speed for speed in first if speed in port.speeds]
        self._search = Autosense(port.speeds, tuple(port.good_speeds), now, first, pending)
        self.speed = self._search.speed

    def receive(self, data: bytes, now: float) -> Event | None:
        self._search.receive(data, now)
        return self._event()

    def tick(self, now: float) -> Event | None:
        self._search.tick(now)
        return self._event()

    def deadline(self) -> float:
        """A search always has a next step."""
        return self._search.next_deadline()

    def take_output(self) -> list[bytes]:
        return self._search.take_output()

    def _event(self) -> Event | None:
        self.speed = self._search.speed
        found = self._search.found
        if found is None:
            return None
        self.port.output += self._search.take_output()
        if self.speed in self.port.good_speeds:
            self.port.good_speeds.remove(self.speed)
        self.port.good_speeds.append(self.speed)
        return found
