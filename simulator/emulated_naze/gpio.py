# SPDX-License-Identifier: GPL-3.0-or-later
"""A port of general-purpose pins (section 9.2)."""

from simulator.emulated_naze.bus import Registers

_CRL, _CRH, _IDR, _ODR = 0x00, 0x04, 0x08, 0x0C
_ALL_FLOATING = 0x4444_4444
_PINS = 16


class Gpio(Registers):
    """`outside`: the levels that the board applies to input pins, one bit each."""

    def __init__(self, outside: int = 0xFFFF) -> None:
        super().__init__()
        self._outside = outside

    def reset(self) -> None:
        """Make all pins floating inputs."""
        self.words = {_CRL: _ALL_FLOATING, _CRH: _ALL_FLOATING}

    def read(self, offset: int) -> int:
        """Read a word; an output reads as its driven level."""
        if offset != _IDR:
            return super().read(offset)
        modes = self.words[_CRH] << 32 | self.words[_CRL]
        outputs = sum(1 << pin for pin in range(_PINS) if modes >> 4 * pin & 0b11)
        return self.words.get(_ODR, 0) & outputs | self._outside & ~outputs

    def write(self, offset: int, value: int) -> None:
        output = self.words.get(_ODR, 0)
        match offset:
            case 0x10:  # BSRR
                self.words[_ODR] = output & ~(value >> 16) | value & 0xFFFF
            case 0x14:  # BRR
                self.words[_ODR] = output & ~value
            case _:
                super().write(offset, value)
