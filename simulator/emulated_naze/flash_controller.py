# SPDX-License-Identifier: GPL-3.0-or-later
"""The flash and its controller: keys, the rules of NOR, and a stalled core (PM0075, sections 2.3 and 3)."""

import random
from collections.abc import Callable

from protocols.firmware_image import FLASH_BASE, FLASH_SIZE
from simulator.emulated_naze.switches import EmulatedCounters, EmulatedFaults

PAGE_SIZE = 1024
_KEYS = (0x4567_0123, 0xCDEF_89AB)
_PROGRAM_ERROR, _PROTECTION_ERROR, _END = 1 << 2, 1 << 4, 1 << 5
_PG, _PER, _MER, _STRT, _LOCK = 1, 1 << 1, 1 << 2, 1 << 6, 1 << 7
_ERASED = 0xFFFF
#: Data sheet DS5319, table 29: typical of a half-word, and within the range of a page.
_PROGRAM_NS = 52_500
_ERASE_NS = 25_000_000


class FlashController:
    """`memory` is the chip's contents. `stall` lets time pass while the core is stalled.

    An operation is a page erased or a half-word programmed. `tear` decides its result after a power cut.
    """

    def __init__(
        self,
        memory: memoryview,
        stall: Callable[[int], None],
        tear: random.Random,
        faults: EmulatedFaults,
        counters: EmulatedCounters,
    ) -> None:
        self._memory = memory
        self._stall = stall
        self._tear = tear
        self._faults = faults
        self._counters = counters
        #: Called in the middle of the operation that a power failure interrupts.
        self.on_power_cut: Callable[[], None] = lambda: None
        self.reset()

    def reset(self) -> None:
        self._control = _LOCK
        self._status = self._address = self._keys = 0

    def read(self, offset: int) -> int:
        match offset:
            case 0x0C:  # SR
                return self._status
            case 0x10:  # CR
                return self._control
            case 0x1C:  # OBR
                return 0x03FF_FFFC
            case 0x20:  # WRPR
                return 0xFFFF_FFFF
        return 0

    def write(self, offset: int, value: int) -> None:
        match offset:
            case 0x04:  # KEYR
                self._take_key(value)
            case 0x0C:  # SR
                self._status &= ~(value & (_PROGRAM_ERROR | _PROTECTION_ERROR | _END))
            case 0x10:  # CR
                self._write_control(value)
            case 0x14:  # AR
                self._address = value

    def _take_key(self, key: int) -> None:
        if key == _KEYS[self._keys]:
            self._keys += 1
            if self._keys == len(_KEYS):
                self._keys = 0
                self._control &= ~_LOCK
        else:
            self._keys = 0

    def _write_control(self, value: int) -> None:
        if self._control & _LOCK:
            return
        self._control = value & ~_STRT
        if value & _STRT and value & _PER:
            self._erase(self._address - FLASH_BASE & -PAGE_SIZE)
        elif value & _STRT and value & _MER:
            for at in range(0, FLASH_SIZE, PAGE_SIZE):
                self._erase(at)

    def _erase(self, at: int) -> None:
        if not 0 <= at < FLASH_SIZE:
            self._status |= _PROTECTION_ERROR
            return
        self._counters.flash_erases += 1
        if self._loses_power():
            self._tear_page(at)
            self.on_power_cut()
        elif not self._fails():
            self._memory[at : at + PAGE_SIZE] = b"\xff" * PAGE_SIZE
            self._status |= _END
            self._stall(_ERASE_NS)

    def program(self, at: int, size: int, value: int) -> None:
        """Handle a store by the core into the flash, at an offset."""
        if not self._control & _PG or size != 2 or at % 2:
            self._status |= _PROGRAM_ERROR
            return
        self._counters.flash_programs += 1
        present = int.from_bytes(self._memory[at : at + 2], "little")
        if self._loses_power():
            kept = self._tear.getrandbits(16)
            self._memory[at : at + 2] = (present & (value | kept)).to_bytes(2, "little")
            self.on_power_cut()
        elif present != _ERASED and value:
            self._status |= _PROGRAM_ERROR
        elif not self._fails():
            self._memory[at : at + 2] = value.to_bytes(2, "little")
            self._status |= _END
            self._stall(_PROGRAM_NS)

    def _loses_power(self) -> bool:
        if not self._faults.power_cut_at_flash_operation:
            return False
        self._faults.power_cut_at_flash_operation -= 1
        return not self._faults.power_cut_at_flash_operation

    def _tear_page(self, at: int) -> None:
        """Leave a possible result of an interrupted erase: the old page, a blank one, or any mixture."""
        page = self._memory[at : at + PAGE_SIZE]
        match self._tear.randrange(4):
            case 1:
                page[:] = b"\xff" * PAGE_SIZE
            case 2:
                page[:] = bytes(byte | self._tear.getrandbits(8) for byte in page)
            case 3:
                page[:] = bytes(0xFF if self._tear.getrandbits(1) else byte for byte in page)

    def _fails(self) -> bool:
        if not self._faults.flash_failures:
            return False
        self._faults.flash_failures -= 1
        self._status |= _PROGRAM_ERROR
        return True
