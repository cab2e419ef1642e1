# SPDX-License-Identifier: GPL-3.0-or-later
"""Random values around zero that change slowly: gusts, and a GPS module's wandering position."""

import random
from math import exp, sqrt


class Wander:
    """A first-order Gauss-Markov process: standard deviation `sigma`, correlated over about `memory_s`."""

    def __init__(self, noise: random.Random, sigma: float, memory_s: float) -> None:
        self._noise = noise
        self._sigma = sigma
        self._memory_s = memory_s
        self.value = noise.gauss(0.0, sigma) if sigma else 0.0

    def step(self, dt: float) -> float:
        """The value after `dt` more seconds."""
        keep = exp(-dt / self._memory_s)
        self.value = keep * self.value + self._noise.gauss(0.0, self._sigma) * sqrt(1 - keep * keep)
        return self.value
