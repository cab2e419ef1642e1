# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's sensor chips in a simulated sky: registers and bytes for what `Sky` measures.

Mounting on a Naze32: the MPU-6050's axes are forward, left, up. The HMC5883L's are back, right, up.
"""

import random
from collections.abc import Callable
from math import degrees

from simulator.emulated_naze import hmc5883l, mpu6050, ms5611
from simulator.sky.body import GRAVITY
from simulator.sky.sky import Sky

#: At the firmware's ranges: 8 g, 2000 degrees/s, 1.3 gauss.
_PER_G, _PER_DEGREE, _PER_GAUSS = 4096, 16.4, 1090
_RATE_OFFSET = (3, -2, 1)
_MOST = 32767


class SkyImu(mpu6050.Mpu6050):
    """`advance` brings the sky to the present before each measurement."""

    def __init__(self, noise: random.Random, sky: Sky, advance: Callable[[], None]) -> None:
        self._sky, self._advance = sky, advance
        super().__init__(noise)

    def _measure(self) -> tuple[int, ...]:
        self._advance()
        motion = self._sky.motion()
        acceleration = (_fit(part / GRAVITY * _PER_G) for part in motion.acceleration)
        rates = (
            _fit(degrees(part) * _PER_DEGREE) + zero for part, zero in zip(motion.rates, _RATE_OFFSET, strict=True)
        )
        return (*acceleration, mpu6050.TEMPERATURE, *rates)


class SkyCompass(hmc5883l.Hmc5883l):
    """Measures the earth's field."""

    def __init__(self, noise: random.Random, sky: Sky, advance: Callable[[], None]) -> None:
        super().__init__(noise)
        self._sky, self._advance = sky, advance

    def _field(self) -> tuple[int, int, int]:
        self._advance()
        forward, left, up = self._sky.magnetic_field()
        return _fit(-forward * _PER_GAUSS), _fit(up * _PER_GAUSS), _fit(-left * _PER_GAUSS)


class SkyBarometer(ms5611.Ms5611):
    """Measures the air pressure at the height."""

    def __init__(self, noise: random.Random, sky: Sky, advance: Callable[[], None]) -> None:
        super().__init__(noise)
        self._sky, self._advance = sky, advance

    def _pressure(self) -> int:
        self._advance()
        return ms5611.converted_pressure(self._sky.pressure())


def _fit(value: float) -> int:
    return max(-_MOST, min(_MOST, round(value)))
