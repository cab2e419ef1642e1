# SPDX-License-Identifier: GPL-3.0-or-later
"""A value on a ground station's screen over time."""

from bisect import bisect_right
from operator import itemgetter
from typing import Generic, TypeVar

T = TypeVar("T")


class Timeline(Generic[T]):
    """Values set in the order of time; `at` answers for any moment. life_s: after this time the first value returns."""

    def __init__(self, first: T, life_s: float | None = None) -> None:
        self.first = first
        self.life_s = life_s
        #: Every value that was set, with its time.
        self.changes: list[tuple[float, T]] = []

    def set(self, at: float, value: T) -> None:
        self.changes.append((at, value))

    def at(self, when: float) -> T:
        if self.changes and when >= self.changes[-1][0]:
            index = len(self.changes) - 1
        else:
            index = bisect_right(self.changes, when, key=itemgetter(0)) - 1
        if index < 0:
            return self.first
        at, value = self.changes[index]
        return self.first if self.life_s is not None and when > at + self.life_s else value

    def values(self, since: float = 0.0) -> list[T]:
        """The values set from a time on."""
        return [value for at, value in self.changes if at >= since]

    def longest_gap_s(self, since: float, until: float) -> float:
        """The longest time without any value but the first."""
        assert self.life_s is not None
        gap, covered = 0.0, since
        for at, value in self.changes:
            if value != self.first and at <= until:
                gap = max(gap, at - covered)
                covered = max(covered, at + self.life_s)
        return max(gap, until - covered)
