# SPDX-License-Identifier: GPL-3.0-or-later
"""A host on the serial line of a simulated board, which carries out dialogues in simulated time."""

import random
from math import inf
from typing import TypeVar

from protocols.stm32_boot_loader import Dialogue
from simulator.board.far_end import FarEnd
from simulator.board.options import Faults, SimOptions
from simulator.naze.board import SimulatedNaze
from simulator.naze.mission_slots import flash_size

T = TypeVar("T")
#: The least step, also of an emulated board.
_STEP_S = 1e-4


class CablePulledError(Exception):
    """The cable was pulled."""


class DialogueBench:
    """`cut_after`: the cable is pulled after so many sent bytes."""

    def __init__(self, board: FarEnd, now: float = 0.0) -> None:
        self.board = board
        self.now = now
        self.sent = 0
        self.cut_after = inf

    def run(self, dialogue: Dialogue[T]) -> T:
        reply = b""
        try:
            step = next(dialogue)
            while True:
                self.board.advance(self.now)
                for byte in step.data:
                    if self.sent == self.cut_after:
                        raise CablePulledError
                    self.board.receive(bytes((byte,)), self.now)
                    self.sent += 1
                reply, end = b"", self.now + step.timeout_s
                while not step.is_complete(reply) and self.now < end:
                    reply += self._next(end)
                step = dialogue.send(reply)
        except StopIteration as finished:
            result: T = finished.value
            return result

    def wait(self, seconds: float) -> bytes:
        end, heard = self.now + seconds, b""
        while self.now < end:
            heard += self._next(end)
        return heard

    def _next(self, end: float) -> bytes:
        self.now = min(max(self.board.next_wakeup(self.now), self.now + _STEP_S), end)
        return self.board.advance(self.now)


def board_in_boot_loader(seed: int = 0) -> SimulatedNaze:
    """A simulated Naze with its boot pads bridged, whose settings and missions are random bytes."""
    options = SimOptions(seed=seed)
    memory = memoryview(bytearray(random.Random(seed).randbytes(flash_size(options))))
    board = SimulatedNaze(options, Faults(extension=False, boot_pads=True), memory)
    board.power_on(0.0)
    return board
