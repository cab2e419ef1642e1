# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits the connections to the status page, so that a hostile browser cannot affect the flight controller.

A connection carries one request and is closed after a few seconds, so that a slow peer occupies nothing for long. The
number of connections is limited, per address and in total; one too many is reset. The rate is limited, too, but there
a connection waits for its turn: a page that is loaded twice in a second must not lose one of its files.
"""

import asyncio
from collections import Counter, deque

import h11
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from service.machine.log_setup import warn_once

#: Responses are a few kilobytes and quick to make.
LIFETIME_S = 15.0
MAX_CONNECTIONS = 48
#: One phone must not lock out the others. A page opens six at once.
MAX_FROM_ONE = 16
#: An open page sends a request per second, a loading one about thirty. A request costs about a millisecond.
MAX_IN_A_SECOND = 100
MAX_IN_A_SECOND_FROM_ONE = 50
_TURN_S = 0.1


class ConnectionLimit:
    """Counts connections; each is cut off after `lifetime_s`."""

    def __init__(self, lifetime_s: float = LIFETIME_S) -> None:
        self.lifetime_s = lifetime_s
        #: The open connections.
        self.transports: set[asyncio.Transport] = set()
        self._inside: Counter[str] = Counter()
        self._lately: deque[tuple[float, str]] = deque(maxlen=MAX_IN_A_SECOND)
        self._malformed = 0
        self._warned: set[str] = set()

    def admit(self, address: str) -> bool:
        """True if there is room for a connection. Each admitted one must `leave`."""
        if self._inside.total() >= MAX_CONNECTIONS or self._inside[address] >= MAX_FROM_ONE:
            return False
        self._inside[address] += 1
        return True

    def take_turn(self, address: str, now: float) -> bool:
        """True if an admitted connection may send its request now (seconds); else it asks again."""
        while self._lately and self._lately[0][0] <= now - 1:
            self._lately.popleft()
        lately = sum(one == address for _, one in self._lately)
        if len(self._lately) >= MAX_IN_A_SECOND or lately >= MAX_IN_A_SECOND_FROM_ONE:
            return False
        self._lately.append((now, address))
        return True

    def leave(self, address: str) -> None:
        self._inside[address] -= 1
        if not self._inside[address]:
            del self._inside[address]

    def count_malformed(self, address: str) -> None:
        self._malformed += 1
        warn_once(self._warned, "web.malformed", peer=address, count=self._malformed)

    def close(self) -> None:
        for transport in list(self.transports):
            transport.abort()


class BoundedConnection(H11Protocol):
    """uvicorn's side of a connection, which begins when its turn comes."""

    def __init__(self, limit: ConnectionLimit, config: Config, state: ServerState) -> None:
        super().__init__(config, state, {})
        self._limit = limit
        self._address = ""
        self._admitted: asyncio.Transport | None = None
        self._end: asyncio.TimerHandle | None = None
        self._turn: asyncio.Handle | None = None
        self._is_served = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for its turn; abort it if there is no room."""
        peer = transport.get_extra_info("peername")
        if peer is None or not self._limit.admit(peer[0]):
            transport.abort()
            return
        self._address = peer[0]
        self._admitted = transport
        self._limit.transports.add(transport)
        self._end = self.loop.call_later(self._limit.lifetime_s, transport.abort)
        # Python 3.11.2, which Debian 12 has, begins to read after this call even if it was told to pause.
        self._turn = self.loop.call_soon(self._await_turn, transport)

    def _await_turn(self, transport: asyncio.Transport) -> None:
        if not self._limit.take_turn(self._address, self.loop.time()):
            transport.pause_reading()
            self._turn = self.loop.call_later(_TURN_S, self._await_turn, transport)
            return
        self._is_served = True
        super().connection_made(transport)
        transport.resume_reading()

    def send_400_response(self, msg: str) -> None:
        """Refuse a request that is not HTTP. Its head may have been: then its handler already runs, or has answered."""
        self._limit.count_malformed(self._address)
        if self.cycle is not None:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            super().send_400_response(msg)
        else:
            self.transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        for timer in self._end, self._turn:
            if timer is not None:
                timer.cancel()
        if self._admitted is not None:
            self._limit.transports.discard(self._admitted)
            self._limit.leave(self._address)
        if self._is_served:
            super().connection_lost(exc)
