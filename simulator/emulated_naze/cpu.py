# SPDX-License-Identifier: GPL-3.0-or-later
"""The Cortex-M3 core on Unicorn: runs code between events, enters exceptions and returns from them.

Unicorn counts instructions, not cycles, and reports the count only when it stops. So code runs in slices that end
when the next alarm is due; within one, each access to a register block takes a fixed time.
"""

import struct
from collections.abc import Callable

import unicorn
from unicorn import arm_const

from simulator.emulated_naze.clock import Clock
from simulator.emulated_naze.nvic import Nvic

#: The average for the firmware's code, with the flash's two wait states.
_CYCLES_PER_INSTRUCTION = 1.5
#: The longest slice: the maximum delay of an interrupt caused by a register access.
_LONGEST_STRETCH_NS = 100_000
_NEVER_REACHED = 0xFFFF_FFF0
_EXCEPTION_EXIT = 8
# EXC_RETURN (ARMv7-M Architecture Reference Manual, B1.5.8): to a handler or to thread mode, on the main stack.
_TO_HANDLER, _TO_THREAD = 0xFFFF_FFF1, 0xFFFF_FFF9
_FRAME_SIZE = 32
_THUMB_BIT = 1 << 24

_SP, _LR, _PC = arm_const.UC_ARM_REG_SP, arm_const.UC_ARM_REG_LR, arm_const.UC_ARM_REG_PC
_XPSR, _PRIMASK = arm_const.UC_ARM_REG_XPSR, arm_const.UC_ARM_REG_PRIMASK


class CpuFaultError(Exception):
    """The code caused a fault exception; one sentence."""


class Cpu:
    """`core_hz` returns the clock's frequency, `vector_table` the address of the exception vectors."""

    def __init__(self, clock: Clock, nvic: Nvic, core_hz: Callable[[], int], vector_table: Callable[[], int]) -> None:
        self._clock = clock
        self._nvic = nvic
        self._core_hz = core_hz
        self._vector_table = vector_table
        self._unicorn = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        self._unicorn.ctl_set_cpu_model(arm_const.UC_CPU_ARM_CORTEX_M3)
        self._unicorn.hook_add(unicorn.UC_HOOK_INTR, self._on_exception)
        self._wants_pause = self._has_returned = False
        self._repeated: int | None = None
        self._fault = ""
        # The registers and return address of the code that each active exception interrupted.
        self._interrupted: list[tuple[unicorn.UcContext, int]] = []
        #: The next instruction.
        self.pc = 0

    # -- memory ----------------------------------------------------------------------------------------------

    def map_memory(self, base: int, size: int, contents: bytes = b"", *, is_ram: bool = False) -> None:
        """Map memory at an address: RAM, or read-only memory. Both are executable."""
        self._unicorn.mem_map(
            base, size, unicorn.UC_PROT_ALL if is_ram else unicorn.UC_PROT_READ | unicorn.UC_PROT_EXEC
        )
        self._unicorn.mem_write(base, contents)

    def load(self, address: int, size: int) -> bytes:
        """Bytes of RAM or flash."""
        return bytes(self._unicorn.mem_read(address, size))

    def store(self, address: int, data: bytes) -> None:
        """Overwrite bytes of RAM."""
        self._unicorn.mem_write(address, data)

    def map_registers(
        self, base: int, size: int, read: Callable[[int, int], int], write: Callable[[int, int, int], None]
    ) -> None:
        """Let `read` (offset, size) and `write` (offset, size, value) handle accesses to a range of addresses.

        When stopped in the middle of an access, Unicorn executes the instruction again. The second access gets the
        first one's result and has no effect.
        """

        def on_read(_: unicorn.Uc, offset: int, size: int, __: object) -> int:
            if self._repeated is not None:
                value, self._repeated = self._repeated, None
                return value
            return self._finish_access(read(offset, size))

        def on_write(_: unicorn.Uc, offset: int, size: int, value: int, __: object) -> None:
            if self._repeated is not None:
                self._repeated = None
                return
            write(offset, size, value)
            self._finish_access(0)

        self._unicorn.mmio_map(base, size, on_read, None, on_write, None)

    def _finish_access(self, value: int) -> int:
        if self._wants_pause or self._nvic.next_exception is not None:
            self._wants_pause = True
            self._repeated = value
            self._unicorn.emu_stop()
        return value

    # -- running ---------------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Begin at the first two vectors: stack pointer and entry."""
        stack, entry = struct.unpack("<II", self.load(self._vector_table(), 8))
        self._unicorn.reg_write(_XPSR, _THUMB_BIT)
        self._unicorn.reg_write(_PRIMASK, 0)
        self._unicorn.reg_write(_SP, stack)
        self._unicorn.reg_write(_LR, 0xFFFF_FFFF)
        self.pc = entry & ~1
        self._fault = ""
        self._repeated = None

    def run_until(self, end_ns: int, goes_on: Callable[[], bool]) -> None:
        """Execute until `end_ns`, or until `goes_on` returns False. CpuFaultError."""
        clock = self._clock
        while clock.now_ns < end_ns and goes_on():
            if self._nvic.next_exception is not None:
                self._take_exception(self._nvic.next_exception)
            stretch_end_ns = min(end_ns, clock.next_ns, clock.now_ns + _LONGEST_STRETCH_NS)
            if stretch_end_ns <= clock.now_ns or self._run_stretch(stretch_end_ns):
                clock.advance(max(stretch_end_ns, clock.now_ns))

    def pause(self) -> None:
        """End the slice after the current register access."""
        self._wants_pause = True

    def _run_stretch(self, end_ns: int) -> bool:
        """Execute until `end_ns`; False if the slice ended earlier."""
        cycles = (end_ns - self._clock.now_ns) * self._core_hz() // 1_000_000_000
        self._wants_pause = self._has_returned = False
        self._execute(max(int(cycles / _CYCLES_PER_INSTRUCTION), 1) + 1)
        was_paused = self._wants_pause
        if was_paused and not self._has_returned:
            self._execute(1)
        if self._has_returned:
            self._return_from_exception()
        return not was_paused

    def _execute(self, instructions: int) -> None:
        try:
            self._unicorn.emu_start(self.pc | 1, _NEVER_REACHED, count=instructions)
        except unicorn.UcError as error:
            raise CpuFaultError(f"{error} at {self._unicorn.reg_read(_PC):#010x}") from error
        self.pc = self._unicorn.reg_read(_PC)
        if self._fault:
            raise CpuFaultError(f"{self._fault} at {self.pc:#010x}")

    # -- exceptions ------------------------------------------------------------------------------------------

    def _take_exception(self, exception: int) -> None:
        """Enter a handler (ARMv7-M manual, B1.5.6).

        Reading and writing eight registers through Unicorn takes longer than most handlers. So the frame's space on the
        stack is reserved, but the registers are kept here: a handler cannot read its caller's.
        """
        if self._unicorn.reg_read(_PRIMASK):
            return
        depth = self._nvic.depth
        if depth == len(self._interrupted):
            self._interrupted.append((self._unicorn.context_save(), 0))
        else:
            context, _ = self._interrupted[depth]
            self._unicorn.context_update(context)
        self._interrupted[depth] = (self._interrupted[depth][0], self.pc)
        frame = self._unicorn.reg_read(_SP) - _FRAME_SIZE & ~7
        self.store(frame, bytes(_FRAME_SIZE))
        self._unicorn.reg_write(_SP, frame)
        self._unicorn.reg_write(_LR, _TO_HANDLER if depth else _TO_THREAD)
        self._unicorn.reg_write(_XPSR, _THUMB_BIT | exception)
        self._nvic.enter(exception)
        (vector,) = struct.unpack("<I", self.load(self._vector_table() + 4 * exception, 4))
        self.pc = vector & ~1

    def _on_exception(self, _: unicorn.Uc, number: int, __: object) -> None:
        if number == _EXCEPTION_EXIT:
            self._has_returned = self._wants_pause = True
        else:
            self._fault = f"exception {number}"
        self._unicorn.emu_stop()

    def _return_from_exception(self) -> None:
        self._nvic.leave()
        context, self.pc = self._interrupted[self._nvic.depth]
        self._unicorn.context_restore(context)
