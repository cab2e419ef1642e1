# SPDX-License-Identifier: GPL-3.0-or-later
"""The peripheral bus: which register block answers at which address (section 3.3, memory map)."""

import logging
from typing import Protocol

from simulator.emulated_naze.pace import Pace

BASE = 0x4000_0000
SIZE = 0x2_4000
_BLOCK_BITS = 10

_log = logging.getLogger(__name__)


class Peripheral(Protocol):
    """A register block. Offsets are multiples of four; a 16-bit access is one to the word's lower half."""

    def reset(self) -> None:
        """Reset to the state after a chip reset."""

    def read(self, offset: int) -> int:
        """Read the word at `offset`, with the side effects of reading."""

    def write(self, offset: int, value: int) -> None:
        """Write a word."""


class Registers:
    """A block whose registers only store written values; the base of those with behaviour."""

    def __init__(self) -> None:
        self.words: dict[int, int] = {}

    def reset(self) -> None:
        self.words.clear()

    def read(self, offset: int) -> int:
        return self.words.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        self.words[offset] = value


class Bus:
    """Passes accesses to the blocks, and reports each to `pace`."""

    def __init__(self, pace: Pace) -> None:
        self._pace = pace
        self._blocks: dict[int, Peripheral] = {}
        self._reported: set[int] = set()

    def attach(self, address: int, peripheral: Peripheral) -> None:
        """Map a block of 1 KB at `address`."""
        self._blocks[(address - BASE) >> _BLOCK_BITS] = peripheral

    def reset(self) -> None:
        for peripheral in dict.fromkeys(self._blocks.values()):
            peripheral.reset()

    def read(self, offset: int, size: int) -> int:
        self._pace.charge_access()
        block = self._blocks.get(offset >> _BLOCK_BITS)
        if block is None:
            self._report(offset)
            return 0
        value = block.read(offset & 0x3FC) >> 8 * (offset & 3) & (1 << 8 * size) - 1
        self._pace.saw(offset, value)
        return value

    def write(self, offset: int, _: int, value: int) -> None:
        """Handle a store. The chip copies a short one to the rest of the word, which no register uses."""
        self._pace.charge_access()
        self._pace.saw(~offset, value)
        block = self._blocks.get(offset >> _BLOCK_BITS)
        if block is None:
            self._report(offset)
        else:
            block.write(offset & 0x3FC, value << 8 * (offset & 3))

    def _report(self, offset: int) -> None:
        block = offset >> _BLOCK_BITS
        if block not in self._reported:
            self._reported.add(block)
            _log.warning("the image uses a peripheral at %#x, which is not emulated", BASE + (block << _BLOCK_BITS))
