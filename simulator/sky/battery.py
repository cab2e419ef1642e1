# SPDX-License-Identifier: GPL-3.0-or-later
"""A lithium battery of three cells."""

_FULL_V, _EMPTY_V = 12.6, 10.2
_RESISTANCE = 0.02
#: A small quad draws about 12 A in a hover with 10 N of thrust.
_A_PER_N = 1.2


class Battery:
    """`capacity_ah`: enough for about 20 minutes by default."""

    def __init__(self, capacity_ah: float = 4.0) -> None:
        self._capacity_ah = capacity_ah
        self.used_ah = 0.0
        self.current = 0.0

    def step(self, dt: float, thrust: float) -> None:
        """Draw the current for a thrust (N) for some seconds."""
        self.current = 0.3 + _A_PER_N * thrust
        self.used_ah += self.current * dt / 3600

    @property
    def volts(self) -> float:
        left = max(1 - self.used_ah / self._capacity_ah, 0.0)
        return _EMPTY_V + (_FULL_V - _EMPTY_V) * left - _RESISTANCE * self.current
