# SPDX-License-Identifier: GPL-3.0-or-later
"""`[[share]]`: TCP and UDP ports on which other programs speak MSP through the bridge."""

import asyncio
from collections.abc import Callable
from typing import cast

from bridge.gcs.budget import TokenBucket
from bridge.gcs.cost import Rate
from protocols.msp.frame import Direction, MspFrame, MspParser
from service.links.gcs_links import LinkError
from service.settings.addresses import GcsAddress, family_of
from storage.os_error import reason

#: A flood would delay telemetry and missions: requests beyond the limit are dropped, the oldest first.
_LIMIT = Rate(200, 200)
_READ_SIZE = 512
#: A client that does not read its replies is disconnected.
_MAX_UNSENT = 65536
#: A further client displaces the one that has been silent for longest: its laptop may have been switched off.
_MAX_CLIENTS = 8

#: Takes a request, and a callback for its reply.
Requested = Callable[[MspFrame, Callable[[MspFrame], None]], None]


async def open_share(address: GcsAddress, requested: Requested) -> Callable[[], None]:
    """Listen, on tcpin or udpin; LinkError if that fails. Returns a function that closes the port and its clients."""
    loop = asyncio.get_running_loop()
    where = (address.host, address.port)
    family = family_of(address.host)
    requests = _Requests(requested)
    try:
        if address.kind == "udpin":
            port, _ = await loop.create_datagram_endpoint(lambda: _UdpShare(requests), local_addr=where, family=family)
            return port.close
        clients: dict[asyncio.Transport, None] = {}  # the one silent for longest first
        server = await loop.create_server(lambda: _TcpClient(requests, clients), *where, family=family)
    except OSError as error:
        raise LinkError(f"share {address} cannot be opened: {reason(error)}") from error

    def close() -> None:
        server.close()
        for client in clients:
            client.abort()

    return close


class _Requests:
    """The requests of all clients of a port."""

    def __init__(self, requested: Requested) -> None:
        self._requested = requested
        self._limit = TokenBucket(_LIMIT)
        self._loop = asyncio.get_running_loop()

    def take(self, data: bytes, parser: MspParser, answer: Callable[[MspFrame], None]) -> None:
        if self._limit.has(self._loop.time()):
            frames = parser.feed(data[-_READ_SIZE:])
            self._limit.spend(len(frames))
            for frame in frames:
                if frame.direction is Direction.REQUEST:
                    self._requested(frame, answer)


class _TcpClient(asyncio.Protocol):
    def __init__(self, requests: _Requests, clients: dict[asyncio.Transport, None]) -> None:
        self._requests = requests
        self._clients = clients
        self._parser = MspParser(takes_low_v2=True)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if len(self._clients) >= _MAX_CLIENTS:
            silent = next(iter(self._clients))
            del self._clients[silent]
            silent.abort()
        self._clients[transport] = None

    def connection_lost(self, exc: Exception | None) -> None:
        self._clients.pop(self._transport, None)

    def data_received(self, data: bytes) -> None:
        del self._clients[self._transport]
        self._clients[self._transport] = None
        self._requests.take(data, self._parser, self._answer)

    def _answer(self, frame: MspFrame) -> None:
        # The client may be gone by now.
        if self._transport.is_closing():
            return
        self._transport.write(frame.encode())
        if self._transport.get_write_buffer_size() > _MAX_UNSENT:
            self._transport.abort()


class _UdpShare(asyncio.DatagramProtocol):
    def __init__(self, requests: _Requests) -> None:
        self._requests = requests

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        # Before Python 3.12 the event loop's transport is not a subclass of it.
        self._transport = cast("asyncio.DatagramTransport", transport)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        def answer(frame: MspFrame) -> None:
            if not self._transport.is_closing():
                self._transport.sendto(frame.encode(), addr)

        # Complete requests only: the rest of a truncated one may be lost.
        self._requests.take(data, MspParser(takes_low_v2=True), answer)
