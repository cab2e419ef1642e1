# SPDX-License-Identifier: GPL-3.0-or-later
"""NOR flash of an STM32F103: erasing sets a page to ones, programming clears bits. Power may fail during either."""

from simulator.board.options import Faults

PAGE_SIZE = 1024
ERASED = 0xFF


class PowerCutError(Exception):
    """The power failed during a flash operation."""


class FlashError(Exception):
    """An erase or a program did not verify."""


class NorFlash:
    """`memory` is the chip: it survives power cuts (a bytearray) or even the program (a mapped file)."""

    def __init__(self, memory: memoryview, faults: Faults) -> None:
        self._memory = memory
        self._faults = faults
        self.operations = 0
        self._busy_seconds = 0.0
        self._is_cut = False

    @property
    def memory(self) -> memoryview:
        return self._memory

    def read(self, offset: int, size: int) -> bytes:
        return bytes(self._memory[offset : offset + size])

    def erase(self, page: int, seconds: float) -> None:
        """Set a page to ones. Raises FlashError if that fails."""
        start = page * PAGE_SIZE
        if self._begin(seconds):
            # An interrupted erase has set only some bits: here those of every other byte.
            step = 2 if self._is_cut else 1
            self._memory[start : start + PAGE_SIZE : step] = bytes((ERASED,)) * (PAGE_SIZE // step)
        self._end(self.read(start, PAGE_SIZE) == bytes((ERASED,)) * PAGE_SIZE)

    def program(self, offset: int, data: bytes, seconds: float) -> None:
        """Clear bits. Raises FlashError if the result is not `data`, for example because the page was not erased."""
        if self._begin(seconds):
            for index in range(len(data) // 2 if self._is_cut else len(data)):
                self._memory[offset + index] &= data[index]
        self._end(self.read(offset, len(data)) == data)

    def take_busy_seconds(self) -> float:
        """How long the chip has stalled the CPU since the last call."""
        seconds, self._busy_seconds = self._busy_seconds, 0.0
        return seconds

    def _begin(self, seconds: float) -> bool:
        """Count an operation. Returns False if the flash controller does not execute it."""
        self.operations += 1
        self._busy_seconds += seconds
        if self._faults.power_cut_at_flash_operation:
            self._faults.power_cut_at_flash_operation -= 1
            self._is_cut = not self._faults.power_cut_at_flash_operation
        if self._faults.flash_failures > 0 and not self._is_cut:
            self._faults.flash_failures -= 1
            return False
        return True

    def _end(self, verified: bool) -> None:
        if self._is_cut:
            self._is_cut = False
            raise PowerCutError
        if not verified:
            raise FlashError
