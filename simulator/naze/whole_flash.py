# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated board's whole flash, as the boot loader sees it: a stand-in for the program, and above it the rest."""

import struct
from contextlib import suppress

from protocols.firmware_image import FLASH_BASE, FLASH_SIZE, PATCH_MARK, ImageError, check_harakiri
from simulator.board.flash import ERASED, PAGE_SIZE, FlashError, NorFlash
from simulator.board.options import Faults

#: Within the data sheet's range for a page; typical of a half-word (DS5319, table 29).
_ERASE_S = 0.025
_HALF_WORD_S = 52.5e-6
_TEXT = b"Harakiri, simulated"
_VERSION_AT = 8
_CONFIG_SIZE = 2 * PAGE_SIZE


def stand_in(*, patched: bool, version: int = 1) -> bytes:
    """An image that has everything by which a Harakiri is recognised, and no code. version: of the configuration."""
    vectors = struct.pack("<II", 0x2000_5000, FLASH_BASE + 9)
    return vectors + bytes((version,)) + _TEXT + (PATCH_MARK if patched else b"")


class WholeFlash:
    """`rest`: the pages below the end of the chip that the simulated firmware uses."""

    def __init__(self, rest: NorFlash, faults: Faults) -> None:
        self._faults = faults
        self._is_rewritten = False
        self._version = 1
        self._rest = rest
        self._rest_at = FLASH_SIZE - len(rest.memory)
        self._program = NorFlash(memoryview(bytearray((ERASED,)) * self._rest_at), faults)
        program = stand_in(patched=faults.extension)
        self._program.memory[: len(program)] = program

    def read(self, at: int, size: int) -> bytes:
        return self.contents[at : at + size]

    def erase(self, page: int, _: float) -> float:
        self._is_rewritten = True
        flash, at = self._place(page * PAGE_SIZE)
        with suppress(FlashError):
            flash.erase(at // PAGE_SIZE, _ERASE_S)
        return flash.take_busy_seconds()

    def program(self, at: int, data: bytes, _: float) -> float:
        flash, at = self._place(at)
        with suppress(FlashError):
            flash.program(at, data, _HALF_WORD_S * len(data) / 2)
        return flash.take_busy_seconds()

    @property
    def contents(self) -> bytes:
        return bytes(self._program.memory) + bytes(self._rest.memory)

    def start(self) -> bool:
        """True if there is a Harakiri that can start. One that was written here has the extension, or not.

        It forgets a configuration of another version.
        """
        if not self._is_rewritten:
            return True
        program = bytes(self._program.memory)
        try:
            check_harakiri(program)
        except ImageError:
            return False
        self._faults.extension = PATCH_MARK in program and b"Harakiri" in program
        if program[_VERSION_AT] != self._version:
            self._version = program[_VERSION_AT]
            self._rest.memory[-_CONFIG_SIZE:] = bytes((ERASED,)) * _CONFIG_SIZE
        return True

    def _place(self, at: int) -> tuple[NorFlash, int]:
        return (self._rest, at - self._rest_at) if at >= self._rest_at else (self._program, at)
