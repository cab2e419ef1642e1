# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may connect to the status page, and for how long: a hostile browser must cost the flight controller nothing.

A connection carries one request and is cut off after a few seconds, so that a peer who sends or reads slowly holds
nothing for long. There are few at a time, and few a second from one address and from all.
"""

import asyncio
from collections import Counter, deque
from collections.abc import Callable

#: An answer is a few kilobytes, and none takes long to make.
LIFETIME_S = 15.0
MAX_CONNECTIONS = 48
#: One phone does not lock out the others. A page that is opened takes six at once.
MAX_FROM_ONE = 16
#: An open page asks once a second, one that is loaded a dozen times at once. A request costs about a millisecond.
MAX_IN_A_SECOND = 100
MAX_IN_A_SECOND_FROM_ONE = 50


class Door:
    """Counts connections. `lifetime_s`: after so long each is cut off."""

    def __init__(self, lifetime_s: float = LIFETIME_S) -> None:
        self.lifetime_s = lifetime_s
        #: Connections that were let in.
        self.transports: set[asyncio.Transport] = set()
        self._inside: Counter[str] = Counter()
        self._lately: deque[tuple[float, str]] = deque(maxlen=MAX_IN_A_SECOND)

    def admit(self, address: str, now: float) -> bool:
        """Let a connection in, or not; now: seconds. Who was let in leaves by `leave`."""
        while self._lately and self._lately[0][0] <= now - 1:
            self._lately.popleft()
        lately = sum(one == address for _, one in self._lately)
        if (
            self._inside.total() >= MAX_CONNECTIONS
            or self._inside[address] >= MAX_FROM_ONE
            or len(self._lately) >= MAX_IN_A_SECOND
            or lately >= MAX_IN_A_SECOND_FROM_ONE
        ):
            return False
        self._inside[address] += 1
        self._lately.append((now, address))
        return True

    def leave(self, address: str) -> None:
        """A connection that was let in is over."""
        self._inside[address] -= 1
        if not self._inside[address]:
            del self._inside[address]

    def close(self) -> None:
        """Hang up on everybody who is inside."""
        for transport in list(self.transports):
            transport.abort()


class BoundedConnection(asyncio.Protocol):
    """Stands between a connection and the HTTP protocol that `serve` makes for it."""

    def __init__(self, door: Door, serve: Callable[[], asyncio.Protocol]) -> None:
        self._door = door
        self._serve = serve
        self._loop = asyncio.get_running_loop()
        self._address = ""
        self._transport: asyncio.Transport | None = None
        self._inner: asyncio.Protocol | None = None
        self._end: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Serve it if there is room."""
        assert isinstance(transport, asyncio.Transport)
        peer = transport.get_extra_info("peername")
        if peer is None or not self._door.admit(peer[0], self._loop.time()):
            transport.abort()
            return
        self._address = peer[0]
        self._transport = transport
        self._door.transports.add(transport)
        self._end = self._loop.call_later(self._door.lifetime_s, transport.abort)
        self._inner = self._serve()
        self._inner.connection_made(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Make room."""
        if self._inner is not None and self._transport is not None and self._end is not None:
            self._end.cancel()
            self._door.transports.discard(self._transport)
            self._door.leave(self._address)
            self._inner.connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Pass it on."""
        if self._inner is not None:
            self._inner.data_received(data)

    def eof_received(self) -> bool | None:
        """Pass it on."""
        return None if self._inner is None else self._inner.eof_received()

    def pause_writing(self) -> None:
        """Pass it on."""
        if self._inner is not None:
            self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Pass it on."""
        if self._inner is not None:
            self._inner.resume_writing()
