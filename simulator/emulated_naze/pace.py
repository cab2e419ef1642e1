# SPDX-License-Identifier: GPL-3.0-or-later
"""The duration of register accesses, and shortened busy-wait loops.

A busy-wait loop reads the time repeatedly while everything else it reads stays the same. After some repetitions each
read lets more time pass than the one before, up to the next alarm.
"""

from simulator.emulated_naze.clock import Clock

#: The time charged for an access: the number of instructions since the last pause is unknown.
_ACCESS_NS = 150
#: With more accesses than this that change nothing, it is a busy-wait loop.
_NORMAL_ACCESSES = 24
_SKIP_NS = 500
_LONGEST_SKIP_NS = 50_000


class Pace:
    """Lets time pass on a clock."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._seen: dict[int, int] = {}
        self._nothing_new = 0

    def spend(self, duration_ns: int) -> None:
        """Let time pass while the core is stalled."""
        self._clock.advance(self._clock.now_ns + duration_ns)

    def charge_access(self) -> None:
        """Let the time of an access pass."""
        self.spend(_ACCESS_NS)

    def saw(self, place: int, value: int) -> None:
        """Note that the firmware has read or written a value at a place (any number that identifies it)."""
        if self._seen.get(place) == value:
            self._nothing_new += 1
        else:
            self._seen[place] = value
            self._nothing_new = 0

    def look_at_time(self) -> None:
        """Note that the firmware is about to read the time."""
        self.charge_access()
        self._nothing_new += 1
        skip_ns = min((self._nothing_new - _NORMAL_ACCESSES) * _SKIP_NS, _LONGEST_SKIP_NS)
        if skip_ns > 0:
            self._clock.advance(min(self._clock.now_ns + skip_ns, self._clock.next_ns))
