# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves bytes between a simulated board and a file descriptor, at the right times of an asyncio loop."""

import asyncio
import contextlib
import os
from collections.abc import Callable

from simulator.board.far_end import FarEnd
from simulator.board.line import garble

_READ_SIZE = 4096
# The longest delay until a changed fault is noticed.
_LONGEST_SLEEP = 0.25


class Pump:
    """Owns only the timer and reader: `fd` is non-blocking and stays the caller's.

    `far_baud` returns the speed set at the other end. Without it both ends always agree. `on_hangup` is
    called when the other end is gone.
    """

    def __init__(
        self,
        board: FarEnd,
        fd: int,
        loop: asyncio.AbstractEventLoop,
        *,
        far_baud: Callable[[], int] | None = None,
        on_hangup: Callable[[], None] | None = None,
    ) -> None:
        self._board = board
        self._fd = fd
        self._loop = loop
        self._far_baud = far_baud
        self._on_hangup = on_hangup
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        self._loop.add_reader(self._fd, self._on_readable)
        self.poke()

    def stop(self) -> None:
        """Stop. Afterwards the descriptor may be closed."""
        self._loop.remove_reader(self._fd)
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def poke(self) -> None:
        """Collect the board's output and sleep until there is more."""
        if self._timer:
            self._timer.cancel()
        now = self._loop.time()
        self._send(self._board.advance(now))
        wakeup = min(self._board.next_wakeup(now), now + _LONGEST_SLEEP)
        self._timer = self._loop.call_at(wakeup, self.poke)

    def _send(self, data: bytes) -> None:
        if not data:
            return
        if self._far_baud:
            data = garble(data, self._board.baud, self._far_baud())
        # As on a real wire, bytes without a reader are lost.
        with contextlib.suppress(BlockingIOError, BrokenPipeError, ConnectionResetError):
            os.write(self._fd, data)

    def _on_readable(self) -> None:
        try:
            data = os.read(self._fd, _READ_SIZE)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.stop()
            if self._on_hangup:
                self._on_hangup()
            return
        if self._far_baud:
            data = garble(data, self._far_baud(), self._board.baud)
        self._board.receive(data, self._loop.time())
        self.poke()
