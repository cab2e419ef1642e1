# SPDX-License-Identifier: GPL-3.0-or-later
"""Wind: a steady part and gusts."""

import random
from math import cos, radians, sin

from simulator.sky.noise import Wander
from simulator.sky.vectors import ZERO, Vector

#: Gusts as a part of the wind's speed (turbulence intensity over open land), and how long one lasts.
_INTENSITY, _VERTICAL_INTENSITY, _GUST_S = 0.2, 0.08, 3.0
_STEP_S = 0.05


class Wind:
    """`speed` m/s from `from_deg` (degrees clockwise from north, as in weather reports)."""

    def __init__(self, speed: float = 0.0, from_deg: float = 270.0, seed: int = 0, *, gusts: bool = True) -> None:
        noise = random.Random(f"wind {seed}")
        angle = radians(from_deg)
        # It blows towards the opposite direction; y is west.
        self._steady = (-speed * cos(angle), speed * sin(angle))
        self._gusts = tuple(
            Wander(noise, speed * part if gusts else 0.0, _GUST_S)
            for part in (_INTENSITY, _INTENSITY, _VERTICAL_INTENSITY)
        )
        self._next_s = 0.0
        self._now: Vector = (*self._steady, 0.0) if speed else ZERO
        self._is_calm = not speed

    def at(self, now_s: float) -> Vector:
        """The air's velocity, world axes. Times must not go back."""
        if self._is_calm or now_s < self._next_s:
            return self._now
        self._next_s = now_s + _STEP_S
        north, west, up = (gust.step(_STEP_S) for gust in self._gusts)
        self._now = self._steady[0] + north, self._steady[1] + west, up
        return self._now
