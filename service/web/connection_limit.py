# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits the connections to the status page, so that hostile browsers do not affect the flight controller or others.

A connection carries one request and is closed after a few seconds. If there are too many, the address with the most
connections loses the oldest of them. Requests take turns between addresses, so many hosts cannot keep the page from
another.
"""

import asyncio
from collections import deque
from ipaddress import ip_network

import h11
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

#: Responses are a few kilobytes and quick to make.
LIFETIME_S = 15.0
#: A waiting connection has a few kilobytes. A browser opens six at once.
MAX_CONNECTIONS = 200
#: An open page sends a request per second. A request costs about a millisecond.
MAX_IN_A_SECOND = 100
#: Served at once: a page that loads sends about as many.
MAX_AT_ONCE = 30
_TURN_S = 1 / MAX_IN_A_SECOND


class ConnectionLimit:
    """The open connections by host, and those that wait for their turn. Times are seconds."""

    def __init__(self) -> None:
        #: The oldest first.
        self._open: dict[str, list[BoundedConnection]] = {}
        #: The host whose turn is next comes first.
        self._waiting: dict[str, deque[BoundedConnection]] = {}
        #: When the turns taken so far are used up, at the highest rate.
        self._used_until = 0.0
        self._timer: asyncio.TimerHandle | None = None

    def enter(self, address: str, connection: "BoundedConnection") -> None:
        """Take a connection. If there are too many, the oldest one of the host with the most is closed."""
        host = _host(address)
        if sum(map(len, self._open.values())) >= MAX_CONNECTIONS:
            largest = max(self._open, key=lambda each: (len(self._open[each]), each == host))
            oldest = self._open[largest][0]
            self._remove(largest, oldest)
            oldest.abort()
        self._open.setdefault(host, []).append(connection)
        self._waiting.setdefault(host, deque()).append(connection)

    def serve(self, now: float) -> float | None:
        """Begin the connections whose turn it is. The time of the next turn, None if no connection waits."""
        while self._waiting:
            free_at = self._used_until - (MAX_AT_ONCE - 1) * _TURN_S
            if free_at > now:
                return free_at
            self._used_until = max(self._used_until, now) + _TURN_S
            host = next(iter(self._waiting))
            waiting = self._waiting.pop(host)
            connection = waiting.popleft()
            if waiting:
                self._waiting[host] = waiting
            connection.begin()
        return None

    def serve_in_time(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin the connections whose turn it is, now and later."""
        if self._timer is None and (due := self.serve(loop.time())) is not None:
            self._timer = loop.call_at(due, self._turn_came, loop)

    def _turn_came(self, loop: asyncio.AbstractEventLoop) -> None:
        self._timer = None
        self.serve_in_time(loop)

    def leave(self, address: str, connection: "BoundedConnection") -> None:
        self._remove(_host(address), connection)

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        for connection in [each for connections in self._open.values() for each in connections]:
            connection.abort()

    def _remove(self, host: str, connection: "BoundedConnection") -> None:
        for kept in (self._open, self._waiting):
            if connection in kept.get(host, ()):
                kept[host].remove(connection)
                if not kept[host]:
                    del kept[host]


def _host(address: str) -> str:
    """An IPv6 host may use any address of its network."""
    return str(ip_network(f"{address.partition('%')[0]}/64", strict=False)) if ":" in address else address


class BoundedConnection(H11Protocol):
    """uvicorn's side of a connection, which begins when its turn comes."""

    def __init__(
        self, limit: ConnectionLimit, config: Config, state: ServerState, lifetime_s: float = LIFETIME_S
    ) -> None:
        super().__init__(config, state, {})
        self._limit = limit
        self._lifetime_s = lifetime_s
        self._address = ""
        self._timers: list[asyncio.Handle] = []
        self._is_served = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        self.transport = transport
        peer = transport.get_extra_info("peername")
        if peer is None:
            transport.abort()
            return
        self._address = peer[0]
        self._limit.enter(self._address, self)
        # Python 3.11.2, which Debian 12 has, begins to read after this call even if it was told to pause.
        self._timers = [
            self.loop.call_later(self._lifetime_s, transport.abort),
            self.loop.call_soon(self._await_turn),
        ]

    def _await_turn(self) -> None:
        self._limit.serve_in_time(self.loop)
        if not self._is_served:
            self.transport.pause_reading()

    def begin(self) -> None:
        self._is_served = True
        super().connection_made(self.transport)
        self.transport.resume_reading()

    def abort(self) -> None:
        self.transport.abort()

    def send_400_response(self, msg: str) -> None:
        """Refuse a request that is not HTTP. Its head may have been: then its handler already runs, or has answered."""
        if self.cycle is not None:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            super().send_400_response(msg)
        else:
            self.transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        for timer in self._timers:
            timer.cancel()
        self._limit.leave(self._address, self)
        if self._is_served:
            super().connection_lost(exc)
