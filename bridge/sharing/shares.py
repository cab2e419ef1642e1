# SPDX-License-Identifier: GPL-3.0-or-later
"""Divides the requests of all programs between them. Sans-IO: the time is passed in."""

from collections.abc import Hashable
from math import exp

from bridge.gcs.cost import Rate

#: Counts grow by this factor before they are scaled back, which forgets those below 1 / 1000.
_RESCALE_AT = 1e6
#: After this many times the memory's length every count has decayed to 0; the clock may also start at any value.
_ALL_FORGOTTEN = 50.0


class Shares:
    """A budget for many accounts; uses decay exponentially.

    `rate.burst` uses at once; of these, at most `rate.per_s` are regained in a second.
    """

    def __init__(self, rate: Rate) -> None:
        self._burst = rate.burst
        self._memory_s = rate.burst / rate.per_s
        # Instead of shrinking all counts over time, the unit of counting grows.
        self._unit = 1.0
        self._unit_at = 0.0
        self._used: dict[Hashable, float] = {}
        self._total = 0.0

    def left(self, now: float) -> float:
        """The uses left; below 0 if more were spent."""
        self._unit *= exp(min(max(0.0, now - self._unit_at) / self._memory_s, _ALL_FORGOTTEN))
        self._unit_at = now
        if self._unit >= _RESCALE_AT:
            kept = {account: used / self._unit for account, used in self._used.items()}
            self._used = {account: used for account, used in kept.items() if used >= 1e-3}
            self._total = sum(self._used.values())
            self._unit = 1.0
        return self._burst - self._total / self._unit

    def used(self, account: Hashable) -> float:
        """The account's recent uses, as of the last call of `left`."""
        return self._used.get(account, 0.0) / self._unit

    def spend(self, account: Hashable, amount: float = 1.0) -> None:
        """Count a use; a negative amount takes it back."""
        self._used[account] = self._used.get(account, 0.0) + amount * self._unit
        self._total += amount * self._unit
