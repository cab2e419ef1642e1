# SPDX-License-Identifier: GPL-3.0-or-later
"""A person at the board's USB port: MSP requests and command lines, in emulated time."""

from collections.abc import Callable

from protocols.msp.frame import Direction, MspParser, request
from simulator.board.simulated_board import SimulatedBoard

_STEP_S = 0.02
_IDENT = 100


class ConsoleError(Exception):
    """The board did not carry out a command; one sentence."""


class Console:
    """`on_time` is called with the emulated time now and then."""

    def __init__(
        self, board: SimulatedBoard, now: float = 0.0, on_time: Callable[[float], None] = lambda _: None
    ) -> None:
        self.board = board
        self.now = now
        self._on_time = on_time

    def run(self, seconds: float) -> bytes:
        """Let time pass. The bytes that the board sent."""
        end, sent = self.now + seconds, bytearray()
        while self.now < end - 1e-9:
            self.now = min(self.now + _STEP_S, end)
            sent += self.board.advance(self.now)
            self._on_time(self.now)
        return bytes(sent)

    def send(self, data: bytes) -> None:
        self.board.receive(data, self.now)

    def ask(self, command: int, payload: bytes = b"", timeout_s: float = 1.0) -> bytes | None:
        """The reply's payload to an MSP request, or None without one, or if it is refused."""
        return self.exchange(request(command, payload), command, timeout_s)

    def exchange(self, frame: bytes, command: int, timeout_s: float = 1.0) -> bytes | None:
        """The payload of the reply to `command`, which `frame` requests, or None without one, or if it is refused."""
        parser = MspParser()
        self.send(frame)
        end = self.now + timeout_s
        while self.now < end:
            for reply in parser.feed(self.run(_STEP_S)):
                if reply.command == command:
                    return reply.payload if reply.direction is Direction.REPLY else None
        return None

    def wait_for_boot(self, timeout_s: float) -> None:
        """Wait until it answers. ConsoleError."""
        self.run(0.6)
        if self.ask(_IDENT, timeout_s=timeout_s) is None:
            raise ConsoleError(f"the board does not answer within {timeout_s:.0f} s after power on")

    def type_lines(self, lines: list[str]) -> str:
        """Open the command line, type these, save and restart; the output."""
        self.send(b"\r\r\r")
        output = self.run(0.5)
        for line in lines:
            self.send(line.encode() + b"\r")
            output += self.run(0.4)
        self.send(b"save\r")
        output += self.run(1.5)
        return output.decode("latin-1")
