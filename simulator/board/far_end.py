# SPDX-License-Identifier: GPL-3.0-or-later
"""The far end of a line: a simulated board."""

from typing import Protocol


class FarEnd(Protocol):
    """Times are passed in: `now` is in seconds of any monotonic clock."""

    @property
    def baud(self) -> int:
        """The current speed."""

    def power_on_booted(self, now: float) -> None:
        """Begin."""

    def receive(self, data: bytes, now: float) -> None:
        """Handle bytes sent to it."""

    def advance(self, now: float) -> bytes:
        """The bytes sent until `now` since the last call."""

    def next_wakeup(self, now: float) -> float:
        """The time for the next call of `advance`, or infinity if nothing will happen by itself."""
