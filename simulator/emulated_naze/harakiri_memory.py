# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's state that no protocol reports, read from the RAM by the image's symbols, and from the flash."""

from enum import Enum
from typing import Protocol

from simulator.board.flash import PAGE_SIZE, NorFlash
from simulator.board.options import Faults, SimOptions
from simulator.emulated_naze.image import Image
from simulator.naze.mission_slots import MissionSlots, slot_pages

#: In the struct of flags `f` (mw.h of both trees), ARMED is the second.
_FLAGS, _ARMED = "f", 1
_PROTOCOL = "Currentprotocol"
#: The patch's two slots (firmware/README.md, Flash map).
_SLOTS = 0x1_DC00


class Memory(Protocol):
    """The chip's RAM and flash."""

    def load(self, address: int, size: int) -> bytes:
        """Bytes at an address."""


class SpokenProtocol(Enum):
    """Values of `Currentprotocol`."""

    AUTOSENSE = 0
    MSP = 1
    MAVLINK = 2


class HarakiriMemory:
    """Reads the memory of a board that runs Harakiri; no other image."""

    def __init__(self, image: Image, ram: Memory, flash: memoryview) -> None:
        self._ram = ram
        self._flags = image.symbols.get(_FLAGS)
        self._protocol = image.symbols.get(_PROTOCOL)
        self._flash = flash

    @property
    def armed(self) -> bool | None:
        """None for an image without symbols."""
        if self._flags is None:
            return None
        return self._ram.load(self._flags + _ARMED, 1) == b"\1"

    @property
    def protocol(self) -> SpokenProtocol | None:
        if self._protocol is None:
            return None
        (value,) = self._ram.load(self._protocol, 1)
        return SpokenProtocol(value) if value < len(SpokenProtocol) else None

    @property
    def stored_records(self) -> list[bytes]:
        """The list that the patched firmware would load at the next start."""
        options = SimOptions()
        pages = self._flash[_SLOTS : _SLOTS + 2 * slot_pages(options.capacity) * PAGE_SIZE]
        slots = MissionSlots(NorFlash(pages, Faults()), options)
        return [slots.read(index, 1) for index in range(slots.stored.count)]
