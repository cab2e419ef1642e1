# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulated Naze within the daemon's process, behind one end of a socket pair (`--fc sim:`)."""

import asyncio
import socket

from simulator.naze import SimulatedNaze
from simulator.pump import Pump


class SimLink:
    """Connects a SimulatedNaze with whoever holds the socket that `start` returns. Speeds always match."""

    def __init__(self, naze: SimulatedNaze, loop: asyncio.AbstractEventLoop) -> None:
        self._naze = naze
        self._loop = loop
        self._near: socket.socket | None = None
        self._pump: Pump | None = None

    async def start(self) -> socket.socket:
        """Supply the board, booted, and return the non-blocking far end, which is the caller's to close.

        Called again it is the port's return: an older far end reads end-of-file, the board goes on as it was.
        """
        self.stop()
        self._near, far = socket.socketpair()
        self._near.setblocking(False)
        far.setblocking(False)
        self._naze.power_on_booted(self._loop.time())
        self._pump = Pump(self._naze, self._near.fileno(), self._loop, on_hangup=self.stop)
        self._pump.start()
        return far

    def stop(self) -> None:
        """Pull the plug: the far end reads end-of-file. The board keeps its power and its state."""
        if self._pump and self._near:
            self._pump.stop()
            self._near.close()
            self._pump = self._near = None

    def poke(self) -> None:
        """Make a fault that was just switched count at once."""
        if self._pump:
            self._pump.poke()
