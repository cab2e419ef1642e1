# SPDX-License-Identifier: GPL-3.0-or-later
"""The system control space at 0xE000E000: SysTick, NVIC and the system control block (ARMv7-M manual, B3.2)."""

from collections.abc import Callable

from simulator.emulated_naze.nvic import Nvic
from simulator.emulated_naze.systick import SYSTICK_EXCEPTION, SysTick

BASE = 0xE000_E000
SIZE = 0x1000
_ICSR, _VTOR, _AIRCR = 0xD04, 0xD08, 0xD0C
_CORTEX_M3_R1P1 = 0x411F_C231
_HANDLER_PRIORITIES = 0xD18
_FIRST_PRIORITY = 4
_PENDST_SET = 1 << 26
_KEY, _READ_KEY = 0x05FA, 0xFA05
_RESET_REQUEST = 1 << 2


class SystemControl:
    """`on_reset` is called when the firmware asks for a reset."""

    def __init__(self, nvic: Nvic, systick: SysTick, on_reset: Callable[[], None]) -> None:
        self._nvic = nvic
        self._systick = systick
        self._on_reset = on_reset
        self.reset()

    def reset(self) -> None:
        self._nvic.reset()
        self._systick.reset()
        self._rest: dict[int, int] = {}

    @property
    def vector_table(self) -> int:
        return self._rest.get(_VTOR, 0)

    def read(self, offset: int, size: int) -> int:
        return self._word(offset & ~3) >> 8 * (offset & 3) & (1 << 8 * size) - 1

    def _word(self, offset: int) -> int:
        if 0x10 <= offset < 0x20:
            return self._systick.read(offset)
        if 0x100 <= offset < 0x500:
            return self._nvic.read(offset)
        if _HANDLER_PRIORITIES <= offset < _HANDLER_PRIORITIES + 12:
            first = _FIRST_PRIORITY + offset - _HANDLER_PRIORITIES
            return sum(self._nvic.priority(first + byte) << 8 * byte for byte in range(4))
        match offset:
            case 0xD00:  # CPUID
                return _CORTEX_M3_R1P1
            case 0xD04:  # ICSR
                return self._nvic.active
            case 0xD0C:  # AIRCR
                return _READ_KEY << 16 | self._nvic.priority_group << 8
        return self._rest.get(offset, 0)

    def write(self, offset: int, size: int, value: int) -> None:
        if 0x10 <= offset < 0x20:
            self._systick.write(offset, value)
        elif 0x100 <= offset < 0x500:
            self._nvic.write(offset, size, value)
        elif _HANDLER_PRIORITIES <= offset < _HANDLER_PRIORITIES + 12:
            for byte in range(size):
                number = _FIRST_PRIORITY + offset - _HANDLER_PRIORITIES + byte
                self._nvic.set_priority(number, value >> 8 * byte & 0xFF)
        elif offset == _ICSR:
            if value & _PENDST_SET:
                self._nvic.pend(SYSTICK_EXCEPTION)
        elif offset == _AIRCR:
            if value >> 16 == _KEY:
                self._nvic.priority_group = value >> 8 & 7
                if value & _RESET_REQUEST:
                    self._on_reset()
        else:
            self._rest[offset] = value
