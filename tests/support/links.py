# SPDX-License-Identifier: GPL-3.0-or-later
"""Links and sockets for a test, without a daemon."""

import asyncio
import socket
from contextlib import ExitStack

from bridge.gcs.station import Peer
from service.links.gcs_links import GcsLink, open_link
from service.settings.addresses import parse_gcs
from tests.support.programs import TIMEOUT_S


class RecordedEvents:
    """Records a link's events and its default peers."""

    def __init__(self) -> None:
        self.received: list[tuple[Peer, bytes]] = []
        self.default_peers: dict[Peer, bool] = {}
        self.gone: list[Peer] = []
        self.connected: set[Peer] = set()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        self.received.append((peer, data))

    def is_connected(self, peer: Peer) -> bool:
        return peer in self.connected

    def gcs_gone(self, peer: Peer) -> None:
        self.gone.append(peer)

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        self.default_peers[peer] = until_answered

    def remove_default_peer(self, peer: Peer) -> None:
        del self.default_peers[peer]


class Links:
    """Opens links and sockets that are closed after the test."""

    def __init__(self) -> None:
        self.events = RecordedEvents()
        self._stack = ExitStack()

    def open(self, text: str) -> GcsLink:
        link = open_link(parse_gcs(text), self.events)
        self._stack.callback(link.close)
        return link

    def udp(self, host: str = "127.0.0.1") -> socket.socket:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        client = self._stack.enter_context(socket.socket(family, socket.SOCK_DGRAM))
        client.bind((host, 0))
        client.setblocking(False)
        return client

    def tcp(self, port: int, host: str = "127.0.0.1") -> socket.socket:
        client = self._stack.enter_context(socket.create_connection((host, port)))
        client.setblocking(False)
        return client

    def close(self) -> None:
        self._stack.close()


async def received(end: socket.socket, size: int = 4096) -> bytes:
    async with asyncio.timeout(TIMEOUT_S):
        return await asyncio.get_running_loop().sock_recv(end, size)
