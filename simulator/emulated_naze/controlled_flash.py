# SPDX-License-Identifier: GPL-3.0-or-later
"""The flash as code on the chip writes it: through the registers of its controller."""

from collections.abc import Callable

from protocols.firmware_image import FLASH_BASE
from simulator.board.flash import PAGE_SIZE, PowerCutError
from simulator.emulated_naze.chip import Chip
from simulator.emulated_naze.flash_controller import AR, CR, KEYR, KEYS, LOCK, PER, PG, STRT


class ControlledFlash:
    """For the boot loader. `chip_ns`: the chip's time at a caller's time. PowerCutError if it `has_lost_power`."""

    def __init__(self, chip: Chip, chip_ns: Callable[[float], int], has_lost_power: Callable[[], bool]) -> None:
        self._chip = chip
        self._chip_ns = chip_ns
        self._has_lost_power = has_lost_power

    def read(self, at: int, size: int) -> bytes:
        return self._chip.load(FLASH_BASE + at, size)

    def erase(self, page: int, now: float) -> float:
        began = self._unlock(PER, now)
        self._chip.flash_controller.write(AR, FLASH_BASE + page * PAGE_SIZE)
        self._chip.flash_controller.write(CR, PER | STRT)
        return self._lock(began)

    def program(self, at: int, data: bytes, now: float) -> float:
        began = self._unlock(PG, now)
        for offset in range(0, len(data), 2):
            if not self._has_lost_power():
                value = int.from_bytes(data[offset : offset + 2], "little")
                self._chip.flash_controller.program(at + offset, 2, value)
        return self._lock(began)

    def _unlock(self, control: int, now: float) -> int:
        self._chip.advance(self._chip_ns(now))
        for key in KEYS:
            self._chip.flash_controller.write(KEYR, key)
        self._chip.flash_controller.write(CR, control)
        return self._chip.now_ns

    def _lock(self, began_ns: int) -> float:
        self._chip.flash_controller.write(CR, LOCK)
        if self._has_lost_power():
            raise PowerCutError
        return (self._chip.now_ns - began_ns) / 1e9
