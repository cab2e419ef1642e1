# SPDX-License-Identifier: GPL-3.0-or-later
"""The interrupt controller, which selects the core's next exception (ARMv7-M manual, B1.5 and B3.4)."""

from enum import IntEnum

_FIRST_IRQ = 16
_CLEAR_ENABLE, _SET_PENDING, _CLEAR_PENDING = 0x180, 0x200, 0x280
_PRIORITY = 0x400
# The STM32F103 implements the upper four bits of a priority.
_PRIORITY_MASK = 0xF0
_LOWEST = 0x100


class Irq(IntEnum):
    """Interrupt numbers (section 10.1.2)."""

    DMA1_CHANNEL1 = 11
    TIM2 = 28
    I2C2_EVENT = 33
    I2C2_ERROR = 34
    USART1 = 37
    USART2 = 38

    @staticmethod
    def dma1(channel: int) -> int:
        """The interrupt of a DMA channel, 1 to 7."""
        return Irq.DMA1_CHANNEL1 + channel - 1


class Nvic:
    """Exceptions have their architectural numbers: SysTick 15, interrupts from 16."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self._enabled = 0
        self._pending = 0
        self._lines = 0
        self._system_pending: set[int] = set()
        self._priorities: dict[int, int] = {}
        self._active: list[int] = []
        #: The exception that the core takes next; None if no pending one preempts the current one.
        self.next_exception: int | None = None
        #: PRIGROUP of the AIRCR: this many low bits of a priority, plus one, do not affect preemption.
        self.priority_group = 0

    # -- from the peripherals --------------------------------------------------------------------------------

    def set_line(self, irq: int, is_high: bool) -> None:
        """Set a peripheral's interrupt request; it pends as long as it is high."""
        bit = 1 << irq
        if not is_high:
            self._lines &= ~bit
        elif not self._lines & bit:
            self._lines |= bit
            self._pending |= bit
            self._choose()

    def pend(self, exception: int) -> None:
        """Make a system exception pending."""
        self._system_pending.add(exception)
        self._choose()

    # -- for the core ----------------------------------------------------------------------------------------

    def enter(self, exception: int) -> None:
        """Note that the core has entered the handler."""
        self._active.append(exception)
        self._system_pending.discard(exception)
        if exception >= _FIRST_IRQ:
            self._pending &= ~(1 << exception - _FIRST_IRQ)
        self._choose()

    def leave(self) -> None:
        """Note that the core has left the handler; a line that is still high pends again."""
        exception = self._active.pop()
        if exception >= _FIRST_IRQ:
            self._pending |= self._lines & 1 << exception - _FIRST_IRQ
        self._choose()

    def _choose(self) -> None:
        """Find the exception to take now: the most urgent one, if it would preempt the active one."""
        waiting = list(self._system_pending)
        pending = self._pending & self._enabled
        while pending:
            irq = (pending & -pending).bit_length() - 1
            pending &= pending - 1
            waiting.append(_FIRST_IRQ + irq)
        self.next_exception = None
        if waiting:
            candidate = min(waiting, key=lambda number: (self.priority(number), number))
            if self._group(candidate) < min(map(self._group, self._active), default=_LOWEST):
                self.next_exception = candidate

    @property
    def depth(self) -> int:
        """The number of nested exceptions being handled."""
        return len(self._active)

    @property
    def active(self) -> int:
        """The exception being handled; 0 in thread mode."""
        return self._active[-1] if self._active else 0

    def priority(self, exception: int) -> int:
        """Lower is more urgent."""
        return self._priorities.get(exception, 0)

    def set_priority(self, exception: int, priority: int) -> None:
        self._priorities[exception] = priority & _PRIORITY_MASK

    def _group(self, exception: int) -> int:
        return self.priority(exception) >> self.priority_group + 1

    # -- its registers, at offsets in the system control space -----------------------------------------------

    def read(self, offset: int) -> int:
        """Read a word; only the priorities can be read byte by byte."""
        if offset >= _PRIORITY:
            first = _FIRST_IRQ + offset - _PRIORITY
            return sum(self.priority(first + byte) << 8 * byte for byte in range(4))
        bits = self._enabled if offset < _SET_PENDING else self._pending
        return bits >> 8 * (offset & 0x7C) & 0xFFFF_FFFF

    def write(self, offset: int, size: int, value: int) -> None:
        """Handle a store of `size` bytes."""
        bits = value << 8 * (offset & 0x7F)
        if offset >= _PRIORITY:
            for byte in range(size):
                self.set_priority(_FIRST_IRQ + offset - _PRIORITY + byte, value >> 8 * byte & 0xFF)
        elif offset >= _CLEAR_PENDING:
            self._pending &= ~bits
        elif offset >= _SET_PENDING:
            self._pending |= bits
        elif offset >= _CLEAR_ENABLE:
            self._enabled &= ~bits
        else:
            self._enabled |= bits
        self._choose()
