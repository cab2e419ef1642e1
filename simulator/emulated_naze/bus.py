# SPDX-License-Identifier: GPL-3.0-or-later
"""The register blocks that the firmware uses rarely. The others are in C (`native/bus.c`, section 3.3)."""

import logging
from collections.abc import Mapping
from typing import Protocol

BASE = 0x4000_0000
_RCC, _FLASH_CONTROLLER = 0x4002_1000, 0x4002_2000
_BLOCK_BITS = 10

_log = logging.getLogger(__name__)


class Peripheral(Protocol):
    """A register block. Offsets are multiples of four. A 16-bit access is one to the word's lower half."""

    def reset(self) -> None:
        """Reset to the state after a chip reset."""

    def read(self, offset: int) -> int:
        """Read the word at `offset`, with the side effects of reading."""

    def write(self, offset: int, value: int) -> None:
        """Write a word."""


class Registers:
    """A block whose registers only store written values. The base of those with behaviour."""

    def __init__(self) -> None:
        self.words: dict[int, int] = {}

    def reset(self) -> None:
        self.words.clear()

    def read(self, offset: int) -> int:
        return self.words.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        self.words[offset] = value


class Bus:
    """Passes accesses to the blocks. `others` are those without behaviour, by address."""

    def __init__(self, rcc: Peripheral, flash_controller: Peripheral, others: Mapping[int, Peripheral]) -> None:
        blocks = {_RCC: rcc, _FLASH_CONTROLLER: flash_controller, **others}
        self._blocks = {address - BASE >> _BLOCK_BITS: block for address, block in blocks.items()}
        self._reported: set[int] = set()

    def reset(self) -> None:
        for peripheral in self._blocks.values():
            peripheral.reset()

    def read(self, offset: int, _: int) -> int:
        """Read the word at an offset in the bus."""
        block = self._blocks.get(offset >> _BLOCK_BITS)
        if block is None:
            self._report(offset)
            return 0
        return block.read(offset & 0x3FC)

    def write(self, offset: int, _: int, value: int) -> None:
        """Write a word."""
        block = self._blocks.get(offset >> _BLOCK_BITS)
        if block is None:
            self._report(offset)
        else:
            block.write(offset & 0x3FC, value)

    def _report(self, offset: int) -> None:
        block = offset >> _BLOCK_BITS
        if block not in self._reported:
            self._reported.add(block)
            _log.warning("the image uses a peripheral at %#x, which is not emulated", BASE + (block << _BLOCK_BITS))
