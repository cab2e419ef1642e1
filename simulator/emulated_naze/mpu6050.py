# SPDX-License-Identifier: GPL-3.0-or-later
"""InvenSense MPU-6050, accelerometer and gyroscope (register map RM-MPU-6000A, sections 4.17 to 4.32)."""

import random

from simulator.emulated_naze.register_chip import RegisterChip, word_byte

ADDRESS = 0x68
_MEASUREMENTS, _POWER, _IDENTITY = 0x3B, 0x6B, 0x75
_RESET, _ASLEEP = 0x80, 0x40
#: Level and still, 1 g at the range of 8 g. The gyroscope's zero has an offset.
_STILL = (0, 0, 4096)
#: 30.6 degrees C.
TEMPERATURE = -2000
_DRIFT = (3, -2, 1)


class Mpu6050(RegisterChip):
    """Still and level. The last bits of its measurements are noise from `noise`."""

    def __init__(self, noise: random.Random) -> None:
        super().__init__()
        self._noise = noise
        self._registers = bytearray(256)
        self._measured: tuple[int, ...] = (0,) * 7
        self._reset()

    def _reset(self) -> None:
        self._registers = bytearray(256)
        self._registers[_POWER] = _ASLEEP
        self._registers[_IDENTITY] = ADDRESS

    def begin(self, is_read: bool) -> None:
        """Begin a transfer. All measurements of a read transfer are simultaneous."""
        super().begin(is_read)
        if is_read:
            self._measured = self._measure()

    def get(self, number: int) -> int:
        index = number - _MEASUREMENTS
        if 0 <= index < 2 * len(self._measured):
            return word_byte(self._measured, index)
        return self._registers[number]

    def set(self, number: int, byte: int) -> None:
        """Configure it. Bit 7 of PWR_MGMT_1 is a reset."""
        if number == _POWER and byte & _RESET:
            self._reset()
        else:
            self._registers[number] = byte

    def _measure(self) -> tuple[int, ...]:
        noise = self._noise.randint
        acceleration = (value + noise(-2, 2) for value in _STILL)
        rotation = (value + noise(-1, 1) for value in _DRIFT)
        return (*acceleration, TEMPERATURE, *rotation)
