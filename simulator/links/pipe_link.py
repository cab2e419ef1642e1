# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulated Naze within the daemon's process, on one end of a socket pair (`--fc sim:`)."""

import asyncio
import socket

from simulator.links.pump import Pump
from simulator.naze.board import SimulatedNaze


class SimLink:
    """Connects a SimulatedNaze with the socket that `start` returns. Speeds always match."""

    def __init__(self, naze: SimulatedNaze, loop: asyncio.AbstractEventLoop) -> None:
        self._naze = naze
        self._loop = loop
        self._near: socket.socket | None = None
        self._pump: Pump | None = None

    async def start(self) -> socket.socket:
        """Switch on the board, booted. Returns the non-blocking far end, which the caller must close.

        Called again it reconnects the port: an older far end reads end-of-file, the board keeps running.
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
        """Pull the plug: the far end reads end-of-file. The board keeps the power and the state."""
        if self._pump and self._near:
            self._pump.stop()
            self._near.close()
            self._pump = self._near = None

    def poke(self) -> None:
        if self._pump:
            self._pump.poke()
