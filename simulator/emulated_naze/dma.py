# SPDX-License-Identifier: GPL-3.0-or-later
"""The DMA controller's seven channels, for single transfers requested by a peripheral (section 13)."""

from collections.abc import Callable
from typing import Protocol

from simulator.emulated_naze.nvic import Irq, Nvic

_ISR, _IFCR, _FIRST_CHANNEL, _CHANNEL_SIZE = 0x00, 0x04, 0x08, 20
_ENABLE, _COMPLETE_INTERRUPT, _HALF_INTERRUPT = 1, 2, 4
_CIRCULAR, _MEMORY_INCREMENT = 1 << 5, 1 << 7
_GLOBAL, _COMPLETE, _HALF = 1, 2, 4
_CHANNELS = 7


class Memory(Protocol):
    """The memory that the DMA reads and writes."""

    def load(self, address: int, size: int) -> bytes:
        """Bytes of RAM or flash."""

    def store(self, address: int, data: bytes) -> None:
        """Overwrite bytes of RAM."""


class DmaChannel:
    """One channel. `number` counts from 1."""

    def __init__(self, number: int, dma: "Dma", memory: Memory) -> None:
        self._number = number
        self._dma = dma
        self._memory = memory
        #: Called when the channel is enabled, so that a transmitter starts.
        self.on_enable: Callable[[], None] = lambda: None
        self.reset()

    def reset(self) -> None:
        self._config = self._left = self._size = self._peripheral = self._address = 0

    @property
    def is_ready(self) -> bool:
        """True if it would carry out a transfer."""
        return bool(self._config & _ENABLE and self._left)

    def put(self, value: int) -> None:
        """Transfer from the peripheral to memory."""
        if self.is_ready:
            width = self._width
            self._memory.store(self._next_address(), (value & (1 << 8 * width) - 1).to_bytes(width, "little"))
            self._count()

    def take(self) -> int:
        """Transfer from memory to the peripheral; only while `is_ready`."""
        value = int.from_bytes(self._memory.load(self._next_address(), self._width), "little")
        self._count()
        return value

    def read(self, register: int) -> int:
        """Read CCR, CNDTR, CPAR or CMAR, numbered from 0."""
        return (self._config, self._left, self._peripheral, self._address)[register]

    def write(self, register: int, value: int) -> None:
        """Write one of them. The number of transfers can be changed only while the channel is disabled."""
        match register:
            case 0:
                was_enabled, self._config = self._config & _ENABLE, value
                if value & _ENABLE and not was_enabled:
                    self.on_enable()
            case 1:
                if not self._config & _ENABLE:
                    self._left = self._size = value & 0xFFFF
            case 2:
                self._peripheral = value
            case 3:
                self._address = value

    @property
    def _width(self) -> int:
        """Bytes per transfer in memory."""
        return 1 << (self._config >> 10 & 0b11)

    def _next_address(self) -> int:
        done = self._size - self._left if self._config & _MEMORY_INCREMENT else 0
        return self._address + done * self._width

    def _count(self) -> None:
        self._left -= 1
        if self._left == self._size // 2:
            self._dma.flag(self._number, _HALF, bool(self._config & _HALF_INTERRUPT))
        if not self._left:
            if self._config & _CIRCULAR:
                self._left = self._size
            self._dma.flag(self._number, _COMPLETE, bool(self._config & _COMPLETE_INTERRUPT))


class Dma:
    """The controller."""

    def __init__(self, memory: Memory, nvic: Nvic) -> None:
        self._nvic = nvic
        self._flags = 0
        self._interrupting = 0
        self._channels = [DmaChannel(number, self, memory) for number in range(1, _CHANNELS + 1)]

    def channel(self, number: int) -> DmaChannel:
        """A channel by its number in the manual, from 1."""
        return self._channels[number - 1]

    def reset(self) -> None:
        self._flags = self._interrupting = 0
        for channel in self._channels:
            channel.reset()

    def flag(self, number: int, event: int, interrupts: bool) -> None:
        """Record a channel's progress."""
        self._flags |= (event | _GLOBAL) << 4 * (number - 1)
        if interrupts:
            self._interrupting |= event << 4 * (number - 1)
            self._nvic.set_line(Irq.dma1(number), True)

    def read(self, offset: int) -> int:
        if offset < _FIRST_CHANNEL:
            return self._flags if offset == _ISR else 0
        index, register = divmod(offset - _FIRST_CHANNEL, _CHANNEL_SIZE)
        return self._channels[index].read(register // 4) if index < _CHANNELS and register < 16 else 0

    def write(self, offset: int, value: int) -> None:
        if offset == _IFCR:
            self._clear(value)
        elif offset >= _FIRST_CHANNEL:
            index, register = divmod(offset - _FIRST_CHANNEL, _CHANNEL_SIZE)
            if index < _CHANNELS and register < 16:
                self._channels[index].write(register // 4, value)

    def _clear(self, flags: int) -> None:
        for number in range(1, _CHANNELS + 1):
            shift = 4 * (number - 1)
            mask = flags & 0xF << shift
            if mask & _GLOBAL << shift:
                mask = 0xF << shift
            self._flags &= ~mask
            self._interrupting &= ~mask
            if mask and not self._interrupting & 0xF << shift:
                self._nvic.set_line(Irq.dma1(number), False)
