# SPDX-License-Identifier: GPL-3.0-or-later
"""The core's 24-bit timer, with which the firmware measures time (ARMv7-M Architecture Reference Manual, B3.3)."""

from collections.abc import Callable

from simulator.emulated_naze.clock import Alarm, Clock
from simulator.emulated_naze.nvic import Nvic

SYSTICK_EXCEPTION = 15
_ENABLE, _INTERRUPT, _CORE_CLOCK, _HAS_FIRED = 1, 2, 4, 1 << 16
_MASK = 0xFF_FFFF


class SysTick:
    """`core_hz` returns the core's clock; `on_look` is called before each read of the counter."""

    def __init__(self, clock: Clock, nvic: Nvic, core_hz: Callable[[], int], on_look: Callable[[], None]) -> None:
        self._clock = clock
        self._nvic = nvic
        self._core_hz = core_hz
        self._on_look = on_look
        self._alarm = Alarm(clock, self._fire)
        self.reset()

    def reset(self) -> None:
        self._control = self._reload = 0
        self._has_fired = False
        self._alarm.cancel()

    def read(self, offset: int) -> int:
        match offset:
            case 0x10:  # CTRL
                control = self._control | (_HAS_FIRED if self._has_fired else 0)
                self._has_fired = False
                return control
            case 0x14:  # LOAD
                return self._reload
            case 0x18:  # VAL
                self._on_look()
                if not self._alarm.is_set:
                    return 0
                left = (self._alarm.at_ns - self._clock.now_ns) * self._hz() // 1_000_000_000
                return min(left, self._reload)
        return 0

    def write(self, offset: int, value: int) -> None:
        match offset:
            case 0x10:  # CTRL
                self._control = value & (_ENABLE | _INTERRUPT | _CORE_CLOCK)
                if not value & _ENABLE:
                    self._alarm.cancel()
                elif not self._alarm.is_set:
                    self._restart()
            case 0x14:  # LOAD
                self._reload = value & _MASK
            case 0x18:  # VAL
                self._has_fired = False
                if self._alarm.is_set:
                    self._restart()

    def _hz(self) -> int:
        return self._core_hz() if self._control & _CORE_CLOCK else self._core_hz() // 8

    def _period_ns(self) -> int:
        return (self._reload + 1) * 1_000_000_000 // self._hz()

    def _restart(self) -> None:
        self._alarm.set_in(self._period_ns())

    def _fire(self) -> None:
        # It has fired at its own time, however late the clock was advanced.
        self._alarm.set_at(self._clock.now_ns + self._period_ns())
        self._has_fired = True
        if self._control & _INTERRUPT:
            self._nvic.pend(SYSTICK_EXCEPTION)
