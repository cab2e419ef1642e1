# SPDX-License-Identifier: GPL-3.0-or-later
"""The status page's connections are limited in number, rate and duration."""

import asyncio
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.types import Receive, Scope, Send
from uvicorn.config import Config
from uvicorn.server import ServerState

from service.web.connection_limit import (
    MAX_AT_ONCE,
    MAX_CONNECTIONS,
    MAX_IN_A_SECOND,
    BoundedConnection,
    ConnectionLimit,
)
from tests.support.programs import TIMEOUT_S


@dataclass(eq=False)
class Visitor:
    """A connection; `served_at`: None while it waits."""

    address: str
    limit: ConnectionLimit
    served_at: float | None = None
    is_aborted: bool = False
    now: ClassVar[float] = 0.0

    def begin(self) -> None:
        self.served_at = self.now

    def abort(self) -> None:
        self.is_aborted = True

    def visit(self) -> "Visitor":
        self.limit.enter(self.address, self)  # type: ignore[arg-type]
        self.limit.serve(self.now)
        return self


def pass_time(limit: ConnectionLimit, seconds: float) -> None:
    end = Visitor.now + seconds
    while (due := limit.serve(Visitor.now)) is not None and due <= end:
        Visitor.now = due
    Visitor.now = end
    limit.serve(end)


@pytest.mark.parametrize("hosts", [20, 150])
def test_a_crowd_of_addresses_does_not_keep_the_page_from_another(hosts: int) -> None:
    """Each address opens as many connections as it can, and none of them ends by itself."""
    limit = ConnectionLimit()
    for number in range(10 * MAX_CONNECTIONS):
        Visitor(f"10.0.0.{number % hosts}", limit).visit()
    page = [Visitor("192.168.4.2", limit).visit() for _ in range(6)]
    for number in range(hosts):
        Visitor(f"10.0.0.{number}", limit).visit()
    pass_time(limit, 10)
    assert [each.is_aborted for each in page].count(False) >= (6 if hosts == 20 else 1)
    assert all(each.is_aborted or each.served_at is not None for each in page)


def test_30_connections_are_served_at_once_and_100_in_each_second() -> None:
    limit = ConnectionLimit()
    crowd = [Visitor(f"10.0.0.{number}", limit).visit() for number in range(150)]
    served = [sum(each.served_at is not None for each in crowd)]
    pass_time(limit, 1)
    served.append(sum(each.served_at is not None for each in crowd))
    assert served == [pytest.approx(30, abs=1), pytest.approx(130, abs=1)]


def test_an_ipv6_host_counts_as_one_with_any_of_the_addresses() -> None:
    limit = ConnectionLimit()
    page = Visitor("fe80::1%wlan0", limit).visit()
    for number in range(2 * MAX_CONNECTIONS):
        Visitor(f"fd00::{number:x}", limit).visit()
    assert not page.is_aborted


_STEPS = st.lists(
    st.tuples(st.sampled_from(["a", "a", "b", "c", "d"]), st.sampled_from([0.0, 0.0, 0.01, 0.4]), st.booleans()),
    max_size=500,
)


@given(_STEPS)
def test_the_limits_are_never_exceeded(steps: list[tuple[str, float, bool]]) -> None:
    limit = ConnectionLimit()
    visitors: list[Visitor] = []
    for address, wait_s, leaves in steps:
        pass_time(limit, wait_s)
        inside = [each for each in visitors if each.address == address and not each.is_aborted]
        if leaves and inside:
            limit.leave(address, inside[0])  # type: ignore[arg-type]
            inside[0].is_aborted = True
        else:
            visitors.append(Visitor(address, limit).visit())
        served = sum(each.served_at is not None and each.served_at > Visitor.now - 1 for each in visitors)
        assert sum(not each.is_aborted for each in visitors) <= MAX_CONNECTIONS
        assert served <= MAX_IN_A_SECOND + MAX_AT_ONCE
    pass_time(limit, 60)
    assert not [each for each in visitors if each.served_at is None and not each.is_aborted]


_REQUEST = b"GET / HTTP/1.1\r\nHost: pi\r\nConnection: close\r\n\r\n"


async def _listen(limit: ConnectionLimit, body: bytes, lifetime_s: float = 15) -> tuple[asyncio.Server, int]:
    """A server that answers each request with `body`; its port."""

    async def serve(_scope: Scope, _receive: Receive, send: Send) -> None:
        headers = [(b"connection", b"close"), (b"content-length", str(len(body)).encode())]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    config, state = Config(serve, lifespan="off", ws="none", log_config=None), ServerState()
    make = partial(BoundedConnection, limit, config, state, lifetime_s)
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
        asked = [group.create_task(ask()) for _ in range(2 * MAX_AT_ONCE)]
    assert {task.result() for task in asked} == {b"!"}
    server.close()


_VISITORS = 3


class _NoticedLimit(ConnectionLimit):
    """Reports when all connections are closed."""

    def __init__(self) -> None:
        super().__init__()
        self.emptied = asyncio.Event()
        self._left = 0

    def leave(self, address: str, connection: BoundedConnection) -> None:
        super().leave(address, connection)
        self._left += 1
        if self._left == _VISITORS:
            self.emptied.set()


async def _is_cut_off(request: bytes) -> None:
    """Connect, send a request and stay idle; return once no connection is counted."""
    limit = _NoticedLimit()
    server, port = await _listen(limit, bytes(16 << 20), lifetime_s=0.2)
    connections = [await asyncio.open_connection("127.0.0.1", port, limit=1024) for _ in range(_VISITORS)]
    for _, writer in connections:
        writer.write(request)
    try:
        async with asyncio.timeout(TIMEOUT_S):
            await limit.emptied.wait()
    finally:
        for _, writer in connections:
            writer.close()
        server.close()


async def test_a_silent_connection_is_closed() -> None:
    await _is_cut_off(b"")


async def test_a_connection_that_does_not_read_is_closed() -> None:
    """The answer is larger than the socket buffers."""
    await _is_cut_off(_REQUEST)
