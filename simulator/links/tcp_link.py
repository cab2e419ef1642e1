# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulated board on a TCP port, like INAV's own simulator and Wi-Fi serial adapters."""

import asyncio
import os
import socket
from collections import deque
from collections.abc import Callable

from simulator.board.far_end import FarEnd
from simulator.links.pty_link import PlugError
from simulator.links.pump import Pump

_LOOK_SECONDS = 0.1


class SimTcpLink:
    """One client is served at a time. Further clients are connected but receive nothing until their turn.

    The port is open while `is_alive` returns True.
    """

    def __init__(
        self, board: FarEnd, address: tuple[str, int], loop: asyncio.AbstractEventLoop, is_alive: Callable[[], bool]
    ) -> None:
        self._board = board
        self._address = address
        self._loop = loop
        self._is_alive = is_alive
        self._listener: socket.socket | None = None
        self._waiting: deque[socket.socket] = deque()
        self._client: socket.socket | None = None
        self._pump: Pump | None = None
        self._look: asyncio.TimerHandle | None = None

    def plug(self) -> None:
        """Listen. PlugError if the address is not available."""
        if self._look is None:
            self._listen()
            self._watch()

    def unplug(self) -> None:
        """Disconnect all clients and close the port. The board keeps the power."""
        if self._look:
            self._look.cancel()
            self._look = None
        self._close()

    def poke(self) -> None:
        if self._pump:
            self._pump.poke()
        else:
            self._board.advance(self._loop.time())
        self._follow_board()

    def _watch(self) -> None:
        self._look = self._loop.call_later(_LOOK_SECONDS, self._watch)
        self._follow_board()

    def _follow_board(self) -> None:
        if self._look is None or self._is_alive() == (self._listener is not None):
            return
        if self._listener:
            self._close()
        else:
            self._listen()

    def _listen(self) -> None:
        host, port = self._address
        try:
            self._listener = socket.create_server(self._address)
        except OSError as error:
            # socket's own text repeats the address. getaddrinfo's errors have numbers below 0.
            why = os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror
            raise PlugError(f"{host}:{port} cannot be opened for listening: {why}; give another port") from error
        self._listener.setblocking(False)
        self._loop.add_reader(self._listener, self._on_connection, self._listener)

    def _close(self) -> None:
        if self._listener:
            self._loop.remove_reader(self._listener)
            self._listener.close()
            self._listener = None
        if self._pump:
            self._pump.stop()
            self._pump = None
        for each in (*self._waiting, *filter(None, (self._client,))):
            each.close()
        self._waiting.clear()
        self._client = None

    def _on_connection(self, listener: socket.socket) -> None:
        try:
            client, _ = listener.accept()
        except OSError:
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._waiting.append(client)
        if self._client is None:
            self._serve_next()

    def _serve_next(self) -> None:
        if self._waiting:
            self._client = self._waiting.popleft()
            # Drop output for the previous client. A partial frame from it stays in the receiver.
            self._board.advance(self._loop.time())
            self._pump = Pump(self._board, self._client.fileno(), self._loop, on_hangup=self._on_hangup)
            self._pump.start()

    def _on_hangup(self) -> None:
        if self._client:
            self._client.close()
        self._client = self._pump = None
        self._serve_next()
