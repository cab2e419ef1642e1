# SPDX-License-Identifier: GPL-3.0-or-later
"""The status page's connections are limited in number, rate and duration."""

import asyncio
from collections import Counter
from functools import partial

from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.types import Receive, Scope, Send
from uvicorn.config import Config
from uvicorn.server import ServerState

from service.web.connection_limit import (
    MAX_CONNECTIONS,
    MAX_FROM_ONE,
    MAX_IN_A_SECOND,
    MAX_IN_A_SECOND_FROM_ONE,
    BoundedConnection,
    ConnectionLimit,
)
from tests.support.programs import TIMEOUT_S

visits = st.lists(
    st.tuples(st.sampled_from(["a", "a", "b", "c", "d"]), st.sampled_from([0.0, 0.0, 0.01, 0.4]), st.booleans()),
    max_size=300,
)


@settings(deadline=None)
@given(visits)
def test_the_limits_are_never_exceeded(visits: list[tuple[str, float, bool]]) -> None:
    limit, now = ConnectionLimit(), 100.0
    inside: Counter[str] = Counter()
    served: list[tuple[float, str]] = []
    for address, wait_s, leaves in visits:
        now += wait_s
        if leaves and inside[address]:
            limit.leave(address)
            inside[address] -= 1
        elif limit.admit(address):
            inside[address] += 1
            if limit.take_turn(address, now):
                served.append((now, address))
        lately = [one for at, one in served if at > now - 1]
        assert inside.total() <= MAX_CONNECTIONS
        assert inside[address] <= MAX_FROM_ONE
        assert len(lately) <= MAX_IN_A_SECOND
        assert lately.count(address) <= MAX_IN_A_SECOND_FROM_ONE
    for address, count in inside.items():
        for _ in range(count):
            limit.leave(address)
    assert limit.admit("a")
    assert limit.take_turn("a", now + 2)


_REQUEST = b"GET / HTTP/1.1\r\nHost: pi\r\nConnection: close\r\n\r\n"


async def _listen(limit: ConnectionLimit, body: bytes) -> tuple[asyncio.Server, int]:
    """A server that answers each request with `body`; its port."""

    async def serve(_scope: Scope, _receive: Receive, send: Send) -> None:
        headers = [(b"connection", b"close"), (b"content-length", str(len(body)).encode())]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    config, state = Config(serve, lifespan="off", ws="none", log_config=None), ServerState()
    make = partial(BoundedConnection, limit, config, state)
    server = await asyncio.get_running_loop().create_server(make, "127.0.0.1", 0)
    return server, server.sockets[0].getsockname()[1]


async def test_connections_over_the_rate_wait_and_are_served() -> None:
    server, port = await _listen(ConnectionLimit(), b"!")
    room = asyncio.Semaphore(6)  # as many as a browser opens

    async def ask() -> bytes:
        async with room:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(_REQUEST)
            answer = await reader.read()
            writer.close()
            return answer[-1:]

    async with asyncio.timeout(TIMEOUT_S), asyncio.TaskGroup() as group:
        asked = [group.create_task(ask()) for _ in range(2 * MAX_IN_A_SECOND_FROM_ONE)]
    assert {task.result() for task in asked} == {b"!"}
    server.close()


_VISITORS = 3


class _NoticedLimit(ConnectionLimit):
    """Reports when all connections are closed."""

    def __init__(self) -> None:
        super().__init__(lifetime_s=0.2)
        self.emptied = asyncio.Event()
        self._left = 0

    def leave(self, address: str) -> None:
        super().leave(address)
        self._left += 1
        if self._left == _VISITORS:
            self.emptied.set()


async def _is_cut_off(request: bytes) -> None:
    """Connect, send a request and stay idle; return once no connection is counted."""
    limit = _NoticedLimit()
    server, port = await _listen(limit, bytes(16 << 20))
    connections = [await asyncio.open_connection("127.0.0.1", port, limit=1024) for _ in range(_VISITORS)]
    for _, writer in connections:
        writer.write(request)
    try:
        async with asyncio.timeout(TIMEOUT_S):
            await limit.emptied.wait()
        assert not limit.transports
    finally:
        for _, writer in connections:
            writer.close()
        server.close()


async def test_a_silent_connection_is_closed() -> None:
    await _is_cut_off(b"")


async def test_a_connection_that_does_not_read_is_closed() -> None:
    """The answer is larger than the socket buffers."""
    await _is_cut_off(_REQUEST)
