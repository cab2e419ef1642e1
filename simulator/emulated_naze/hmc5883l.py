# SPDX-License-Identifier: GPL-3.0-or-later
"""Honeywell HMC5883L, magnetometer (data sheet 900405, "Register operation" and "Self test operation")."""

import random

from simulator.emulated_naze.register_chip import RegisterChip, word_byte

ADDRESS = 0x1E
_CONFIGURATION_A = 0
_MEASUREMENTS = 3
_IDENTITY = 10
#: X, Z and Y, in the order of the registers.
_FIELD = (300, 50, -420)
#: The self test's offset in the same order, about 1.1 gauss, by the bias bits.
_BIAS = {0b01: (766, 713, 766), 0b10: (-766, -713, -766)}


class Hmc5883l(RegisterChip):
    """Measures a constant field. The last bit is noise from `noise`."""

    def __init__(self, noise: random.Random) -> None:
        super().__init__()
        self._noise = noise
        self._registers = bytearray(256)
        self._registers[_IDENTITY : _IDENTITY + 3] = b"H43"
        self._measured = _FIELD

    def begin(self, is_read: bool) -> None:
        """Begin a transfer. All measurements of a read transfer are simultaneous."""
        super().begin(is_read)
        if is_read:
            field = _BIAS.get(self._registers[_CONFIGURATION_A] & 0b11) or self._field()
            x, z, y = (value + self._noise.randint(-1, 1) for value in field)
            self._measured = (x, z, y)

    def _field(self) -> tuple[int, int, int]:
        """The field in the order of the registers."""
        return _FIELD

    def get(self, number: int) -> int:
        """Read a measurement or a written value."""
        index = number - _MEASUREMENTS
        if 0 <= index < 6:
            return word_byte(self._measured, index)
        return self._registers[number]

    def set(self, number: int, byte: int) -> None:
        if number < _MEASUREMENTS:
            self._registers[number] = byte
