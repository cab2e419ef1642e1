# SPDX-License-Identifier: GPL-3.0-or-later
"""How long requests took to be answered, counted in classes. Sans-IO."""

from bisect import bisect_left

#: Upper ends of the classes, seconds: a reply takes 2 ms over TCP, 10 ms at 115200 baud, 300 ms at 2400.
BOUNDS_S = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)


class RoundTrips:
    """A histogram. `counts`: one per bound, and a last one for longer times. `sum_s`: the total, seconds."""

    def __init__(self) -> None:
        self.counts = [0] * (len(BOUNDS_S) + 1)
        self.sum_s = 0.0

    def add(self, elapsed_s: float) -> None:
        """Count one."""
        self.counts[bisect_left(BOUNDS_S, elapsed_s)] += 1
        self.sum_s += elapsed_s
