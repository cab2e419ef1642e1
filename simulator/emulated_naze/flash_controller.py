# SPDX-License-Identifier: GPL-3.0-or-later
"""The flash and the controller: keys, the rules of NOR, and a stalled core (PM0075, sections 2.3 and 3)."""

import random
from collections.abc import Callable

from protocols.firmware_image import FLASH_BASE, FLASH_SIZE
from simulator.board.flash import PAGE_SIZE
from simulator.emulated_naze.switches import EmulatedCounters, EmulatedFaults

#: Registers, the keys that unlock the controller, and bits of CR.
KEYR, SR, CR, AR, OBR, WRPR = 0x04, 0x0C, 0x10, 0x14, 0x1C, 0x20
KEYS = (0x4567_0123, 0xCDEF_89AB)
_PROGRAM_ERROR, _PROTECTION_ERROR, _END = 1 << 2, 1 << 4, 1 << 5
PG, PER, MER, STRT, LOCK = 1, 1 << 1, 1 << 2, 1 << 6, 1 << 7
_ERASED = 0xFFFF
#: Data sheet DS5319, table 29: typical of a half-word, and within the range of a page.
_PROGRAM_NS = 52_500
_ERASE_NS = 25_000_000


class FlashController:
    """`memory` is the chip's contents. `stall` lets time pass while the core is stalled.

    An operation is a page erased or a half-word programmed. `tear` decides the result after a power cut.
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
        self._control = LOCK
        self._status = self._address = self._keys = 0

    def read(self, offset: int) -> int:
        words = {SR: self._status, CR: self._control, OBR: 0x03FF_FFFC, WRPR: 0xFFFF_FFFF}
        return words.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        if offset == KEYR:
            self._take_key(value)
        elif offset == SR:
            self._status &= ~(value & (_PROGRAM_ERROR | _PROTECTION_ERROR | _END))
        elif offset == CR:
            self._write_control(value)
        elif offset == AR:
            self._address = value

    def _take_key(self, key: int) -> None:
        if key == KEYS[self._keys]:
            self._keys += 1
            if self._keys == len(KEYS):
                self._keys = 0
                self._control &= ~LOCK
        else:
            self._keys = 0

    def _write_control(self, value: int) -> None:
        if self._control & LOCK:
            return
        self._control = value & ~STRT
        if value & STRT and value & PER:
            self._erase(self._address - FLASH_BASE & -PAGE_SIZE)
        elif value & STRT and value & MER:
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
        if not self._control & PG or size != 2 or at % 2:
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
