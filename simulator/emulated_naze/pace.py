# SPDX-License-Identifier: GPL-3.0-or-later
"""How long things take: accesses to registers, and loops that wait, which are made short for us.

A waiting loop reads the time again and again, and whatever else it looks at stays the same. After some of that, each
look at the time lets a little more of it pass than the one before, up to the next alarm.
"""

from simulator.emulated_naze.clock import Clock

#: What an access is charged while the number of instructions executed since the last pause is not known.
_ACCESS_NS = 150
#: So many accesses that brought nothing new are taken to be no waiting loop yet.
_PATIENCE = 24
_SKIP_NS = 500
_LONGEST_SKIP_NS = 50_000


class Pace:
    """Lets time pass on a clock."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._seen: dict[int, int] = {}
        self._nothing_new = 0

    def spend(self, duration_ns: int) -> None:
        """Let time pass while the core stands still."""
        self._clock.advance(self._clock.now_ns + duration_ns)

    def charge_access(self) -> None:
        """Let the time of an access pass."""
        self.spend(_ACCESS_NS)

    def saw(self, place: int, value: int) -> None:
        """The firmware has read or written a value at a place, any number that stands for it."""
        if self._seen.get(place) == value:
            self._nothing_new += 1
        else:
            self._seen[place] = value
            self._nothing_new = 0

    def look_at_time(self) -> None:
        """The firmware is about to read the time."""
        self.charge_access()
        self._nothing_new += 1
        skip_ns = min((self._nothing_new - _PATIENCE) * _SKIP_NS, _LONGEST_SKIP_NS)
        if skip_ns > 0:
            self._clock.advance(min(self._clock.now_ns + skip_ns, self._clock.next_ns))
