# SPDX-License-Identifier: GPL-3.0-or-later
"""`[[share]]`: TCP and UDP ports on which other programs speak MSP through the bridge."""

import asyncio
from collections.abc import Callable
from typing import Protocol, cast

from protocols.msp.frame import Direction, MspFrame, MspParser
from service.links.gcs_links import LinkError
from service.settings.addresses import family_of
from service.settings.share import ShareSettings

#: A client that does not read its replies is disconnected.
_MAX_UNSENT = 65536
_MAX_CLIENTS = 8


class Requested(Protocol):
    """Takes a request, and a callback for its reply."""

    def __call__(self, frame: MspFrame, answer: Callable[[MspFrame], None], *, may_write: bool) -> None:
        """Forward the request, or answer with a refusal."""


class Share(Protocol):
    """An open port."""

    def close(self) -> None:
        """Close the port and its clients."""


async def open_share(settings: ShareSettings, requested: Requested) -> Share:
    """Listen; LinkError if that fails."""
    loop = asyncio.get_running_loop()
    address = settings.address
    where = (address.host, address.port)
    family = family_of(address.host)
    try:
        if address.kind == "udpin":
            share = _UdpShare(settings, requested)
            await loop.create_datagram_endpoint(lambda: share, local_addr=where, family=family)
            return share
        clients: set[_TcpClient] = set()
        server = await loop.create_server(lambda: _TcpClient(settings, requested, clients), *where, family=family)
        return _TcpShare(server, clients)
    except OSError as error:
        raise LinkError(f"share {address} cannot be opened: {error.strerror or error}") from error


class _TcpShare:
    def __init__(self, server: asyncio.Server, clients: "set[_TcpClient]") -> None:
        self._server = server
        self._clients = clients

    def close(self) -> None:
        self._server.close()
        for client in list(self._clients):
            client.close()


class _TcpClient(asyncio.Protocol):
    def __init__(self, settings: ShareSettings, requested: Requested, clients: "set[_TcpClient]") -> None:
        self._may_write = settings.write
        self._requested = requested
        self._clients = clients
        self._parser = MspParser(takes_low_v2=True)
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        if len(self._clients) >= _MAX_CLIENTS:
            transport.abort()
            return
        self._transport = transport
        self._clients.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None
        self._clients.discard(self)

    def data_received(self, data: bytes) -> None:
        for frame in self._parser.feed(data):
            if frame.direction is Direction.REQUEST:
                self._requested(frame, self._answer, may_write=self._may_write)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.abort()

    def _answer(self, frame: MspFrame) -> None:
        # The client may be gone by now.
        if self._transport is None:
            return
        self._transport.write(frame.encode())
        if self._transport.get_write_buffer_size() > _MAX_UNSENT:
            self._transport.abort()


class _UdpShare(asyncio.DatagramProtocol):
    def __init__(self, settings: ShareSettings, requested: Requested) -> None:
        self._may_write = settings.write
        self._requested = requested
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        # Before Python 3.12 the event loop's transport is not a subclass of it.
        self._transport = cast("asyncio.DatagramTransport", transport)

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        def answer(frame: MspFrame) -> None:
            if self._transport is not None:
                self._transport.sendto(frame.encode(), addr)

        # Complete requests only: the rest of a truncated one may be lost.
        for frame in MspParser(takes_low_v2=True).feed(data):
            if frame.direction is Direction.REQUEST:
                self._requested(frame, answer, may_write=self._may_write)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()
