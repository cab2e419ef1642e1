# SPDX-License-Identifier: GPL-3.0-or-later
"""An I2C chip of byte registers: the first written byte is the register number, which then increments."""

from abc import abstractmethod


class RegisterChip:
    """The base class of such sensors."""

    def __init__(self) -> None:
        self._number = 0
        self._awaits_number = False

    def begin(self, is_read: bool) -> None:
        """Begin a transfer. A write begins with the register number."""
        self._awaits_number = not is_read

    def read(self) -> int:
        number = self._number
        self._number = (number + 1) & 0xFF
        return self.get(number)

    def write(self, byte: int) -> None:
        """Receive the register number, or a byte for the current register."""
        if self._awaits_number:
            self._number = byte
            self._awaits_number = False
        else:
            self.set(self._number, byte)
            self._number = (self._number + 1) & 0xFF

    @abstractmethod
    def get(self, number: int) -> int:
        """Read a register."""

    @abstractmethod
    def set(self, number: int, byte: int) -> None:
        """Write a register."""


def word_byte(values: tuple[int, ...], index: int) -> int:
    """Byte `index` of 16-bit values, each the upper byte first."""
    value = values[index // 2]
    return (value >> 8 if index % 2 == 0 else value) & 0xFF
