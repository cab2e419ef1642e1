# SPDX-License-Identifier: GPL-3.0-or-later
"""The states of the line to a flight controller, one class each. Sans-IO.

Every state takes bytes and time, reports an event when it ends, and has a deadline: no state can wait for ever.
`bridge.fc.session` has the table of which event leads where.
"""

from abc import ABC, abstractmethod
from math import inf
from typing import ClassVar

from bridge.fc.profile import FlightController
from bridge.fc.states.events import Event
from bridge.fc.states.port import Port
from bridge.line.msp_link import MspLink
from bridge.line.pending_replies import PendingReplies


class State(ABC):
    """One state. `receive` and `tick` return the event that ends it, or None."""

    name: ClassVar[str]
    #: Whether the flight controller is still being looked for.
    is_searching: ClassVar[bool] = False
    #: Why the board cannot be used and what the pilot must do; empty if nothing.
    trouble: ClassVar[str] = ""
    controller: FlightController | None = None
    link: MspLink | None = None

    def __init__(self, port: Port, speed: int | None) -> None:
        self.port = port
        self.speed = speed

    @abstractmethod
    def receive(self, data: bytes, now: float) -> Event | None:
        """Take bytes from the port."""

    @abstractmethod
    def tick(self, now: float) -> Event | None:
        """Run the timers."""

    @abstractmethod
    def deadline(self) -> float:
        """The time of the next `tick`; infinity only while the port is closed."""

    def take_output(self) -> list[bytes]:
        """The bytes to be written, in order."""
        output, self.port.output = self.port.output, []
        return output

    def unanswered(self) -> PendingReplies:
        """Replies that may still come: a board that stood still sends them all at once."""
        return PendingReplies()

    @property
    def bad_checksums(self) -> int | None:
        """Damaged frames since the flight controller was found; None if that is not counted."""
        return None


class Closed(State):
    """There is no port."""

    name = "no port"

    def receive(self, data: bytes, now: float) -> Event | None:
        """Bytes that were read before the port closed: dropped."""

    def tick(self, now: float) -> Event | None:
        """Nothing is due."""

    def deadline(self) -> float:
        """Only an open port leads out of here."""
        return inf
