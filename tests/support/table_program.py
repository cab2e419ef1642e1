# SPDX-License-Identifier: GPL-3.0-or-later
"""A small ARM program for the emulated board: it executes a table of loads and stores, and a second table in every
interrupt."""

import struct
from dataclasses import dataclass, field

from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.switches import EmulatedFaults

FLASH, RAM = 0x0800_0000, 0x2000_0000
_STACK = RAM + 0x5000
_CODE, _TABLE, _HANDLER_TABLE, _END = 0x200, 0x400, 0x1800, 0x2000
_LOG, _HANDLER_LOG_END, _HANDLER_LOG = 0x100, 0x800, 0x900
_VECTORS = 80
_STOP, _STORE, _STORE_HALF, _LOAD, _WAIT = range(5)

_THUMB = bytes.fromhex(
    "104f 114e 00f00af8"  # entry:   ldr r7, =table; ldr r6, =log; bl run
    "fee7 00bf"  #           b .; nop
    "f0b5 0f4f 0f4d 2e68"  # handler: push {r4-r7, lr}; ldr r7, =handler table; ldr r5, =log end; ldr r6, [r5]
    "00f002f8 2e60 f0bd"  #          bl run; str r6, [r5]; pop {r4-r7, pc}
    "07cf 78b1"  # run:     ldmia r7!, {r0, r1, r2}; cbz r0, ret
    "0228 02d0 03d8"  #          cmp r0, #2; beq half; bhi more
    "0a60 f8e7"  #          str r2, [r1]; b run
    "0a80 f6e7"  # half:    strh r2, [r1]; b run
    "0428 02d0"  # more:    cmp r0, #4; beq wait
    "0b68 08c6 f1e7"  #          ldr r3, [r1]; stmia r6!, {r3}; b run
    "0b68 1342 fcd0 ede7"  # wait:    ldr r3, [r1]; tst r3, r2; beq wait; b run
    "7047 00bf"  # ret:     bx lr
) + struct.pack("<4I", FLASH + _TABLE, RAM + _LOG, FLASH + _HANDLER_TABLE, RAM + _HANDLER_LOG_END)
_ENTRY, _HANDLER = FLASH + _CODE + 1, FLASH + _CODE + 0x0D


@dataclass(slots=True)
class Steps:
    """A table of loads and stores. Every load is logged."""

    rows: list[tuple[int, int, int]] = field(default_factory=list)

    def store(self, address: int, value: int) -> "Steps":
        self.rows.append((_STORE, address, value))
        return self

    def store_half(self, address: int, value: int) -> "Steps":
        self.rows.append((_STORE_HALF, address, value))
        return self

    def load(self, address: int) -> "Steps":
        self.rows.append((_LOAD, address, 0))
        return self

    def wait(self, address: int, mask: int) -> "Steps":
        """Load until one of these bits is set."""
        self.rows.append((_WAIT, address, mask))
        return self

    def encode(self) -> bytes:
        return b"".join(struct.pack("<III", *row) for row in (*self.rows, (_STOP, 0, 0)))


class Rig:
    """An emulated board that executes `steps`, and `handler` in every interrupt. Power is on from time 0."""

    def __init__(self, steps: Steps, handler: Steps | None = None, flash: memoryview | None = None) -> None:
        # RAM is random at first, so the handler's log is initialised before anything else.
        begun = Steps().store(RAM + _HANDLER_LOG_END, RAM + _HANDLER_LOG)
        begun.rows += steps.rows
        program = bytearray(_END)
        struct.pack_into(f"<{_VECTORS}I", program, 0, _STACK, _ENTRY, *(_HANDLER,) * (_VECTORS - 2))
        for at, data in (
            (_CODE, _THUMB),
            (_TABLE, begun.encode()),
            (_HANDLER_TABLE, (handler or Steps()).encode()),
        ):
            program[at : at + len(data)] = data
        self.board = EmulatedNaze(Image(bytes(program)), EmulatedFaults(), flash)
        self.now = 0.0
        self.received = bytearray()
        self.board.power_on(0.0)

    def run(self, seconds: float) -> "Rig":
        self.now += seconds
        self.received += self.board.advance(self.now)
        return self

    def send(self, data: bytes) -> "Rig":
        self.board.receive(data, self.now)
        return self

    def log(self, count: int) -> list[int]:
        """The first values loaded by the table."""
        return self._words(RAM + _LOG, count)

    def handler_log(self) -> list[int]:
        (end,) = self._words(RAM + _HANDLER_LOG_END, 1)
        return self._words(RAM + _HANDLER_LOG, (end - RAM - _HANDLER_LOG) // 4)

    def ram(self, offset: int, size: int) -> bytes:
        return self.board.peek(RAM + offset, size)

    def _words(self, address: int, count: int) -> list[int]:
        return list(struct.unpack(f"<{count}I", self.board.peek(address, 4 * count)))
