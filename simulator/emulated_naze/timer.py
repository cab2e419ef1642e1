# SPDX-License-Identifier: GPL-3.0-or-later
"""A general-purpose timer: its counter and an input capture; outputs are only remembered (sections 14 and 15)."""

from collections.abc import Callable

from simulator.emulated_naze.bus import Registers
from simulator.emulated_naze.clock import Clock
from simulator.emulated_naze.nvic import Nvic

_CR1, _DIER, _SR, _CNT, _PSC, _ARR, _CCR1 = 0x00, 0x0C, 0x10, 0x24, 0x28, 0x2C, 0x34
_ENABLED = 1
_UPDATE = 1


class Timer(Registers):
    """`hz`: the clock of its prescaler. `irq`: None if its interrupt is unused."""

    def __init__(self, clock: Clock, nvic: Nvic, hz: Callable[[], int], irq: int | None = None) -> None:
        super().__init__()
        self._clock = clock
        self._nvic = nvic
        self._hz = hz
        self._irq = irq
        self._started_ns = 0

    def reset(self) -> None:
        self.words = {_ARR: 0xFFFF}
        self._started_ns = self._clock.now_ns
        self._interrupt()

    def capture(self, channel: int) -> None:
        """Capture the counter at an edge on the input of a channel, from 1."""
        self.words[_CCR1 + 4 * (channel - 1)] = self._count()
        self.words[_SR] = self.words.get(_SR, 0) | 1 << channel
        self._interrupt()

    def read(self, offset: int) -> int:
        return self._count() if offset == _CNT else super().read(offset)

    def write(self, offset: int, value: int) -> None:
        """Write a word. A flag of the status register is cleared by writing a zero."""
        match offset:
            case 0x10:  # SR
                value &= self.words.get(_SR, 0)
            case 0x14:  # EGR
                if value & _UPDATE:
                    self._started_ns = self._clock.now_ns
                return
            case 0x24:  # CNT
                self._started_ns = self._clock.now_ns
        super().write(offset, value)
        self._interrupt()

    def _count(self) -> int:
        if not self.words.get(_CR1, 0) & _ENABLED:
            return 0
        ticks = (self._clock.now_ns - self._started_ns) * self._hz() // 1_000_000_000
        return ticks // (self.words.get(_PSC, 0) + 1) % (self.words.get(_ARR, 0) + 1)

    def _interrupt(self) -> None:
        if self._irq is not None:
            self._nvic.set_line(self._irq, bool(self.words.get(_SR, 0) & self.words.get(_DIER, 0)))
