# SPDX-License-Identifier: GPL-3.0-or-later
"""What may be on the other end of a line: the simulated Naze, or a capture of a real one that is played."""

from typing import Protocol


class FarEnd(Protocol):
    """Has no clock of its own: `now` is in seconds of any monotonic clock."""

    @property
    def baud(self) -> int:
        """Return its speed at this moment."""

    def power_on_booted(self, now: float) -> None:
        """Begin."""

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes that were sent to it."""

    def advance(self, now: float) -> bytes:
        """Return the bytes that it has sent until `now` and that were not returned before."""

    def next_wakeup(self, now: float) -> float:
        """Tell when it is next worth calling `advance`; infinity if nothing will happen by itself."""
