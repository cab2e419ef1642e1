# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations over TCP."""

import asyncio
import socket
from collections import Counter
from math import inf

from bridge.gcs.station import Peer
from protocols.mavlink.dialect import MESSAGE_FORMATS
from protocols.mavlink.frame import MavlinkSplitter
from service.links.gcs_events import GcsEvents
from service.machine.log_setup import warn_once
from service.settings.addresses import GcsAddress, bindable, family_of

#: Small, so that the requests of a client that floods do not delay those of others.
_READ_SIZE = 512
#: Unsent bytes for a stalled client. Above this it does not get telemetry. At twice as many it is disconnected.
_MAX_UNSENT = 32768
#: The kernel would buffer minutes of old telemetry for a client that does not read.
_KERNEL_BUFFER = 32768
#: A client that does not acknowledge anything for this long is lost: out of Wi-Fi range it cannot close the connection.
_STALL_MS = 60000
#: Each costs a copy of the telemetry.
_MAX_CLIENTS = 32
#: Never dropped, because they are not sent again: a transfer, command or parameter would fail. Files and logs are
#: not among them: they fill the buffer at once, and their reader asks again for missing parts.
_KEPT = frozenset(
    msgid
    for msgid, message in MESSAGE_FORMATS.items()
    if message.name != "MISSION_CURRENT"
    and message.name.startswith(
        ("PARAM_", "MISSION_", "COMMAND_", "STATUSTEXT", "AUTOPILOT_VERSION", "MESSAGE_INTERVAL")
    )
)


def must_arrive(data: bytes) -> bool:
    """True if one of these whole frames is not sent again when it is lost."""
    return any(frame.msgid in _KEPT for frame in MavlinkSplitter().feed(data))


class TcpLink:
    """tcpin: ground stations connect. OSError if the port cannot be opened."""

    def __init__(self, address: GcsAddress, events: GcsEvents) -> None:
        self.name = str(address)
        self._events = events
        self.loop = asyncio.get_running_loop()
        self._clients: dict[Peer, _TcpClient] = {}
        self._warned: set[str] = set()
        self._listener = socket.create_server(bindable(address.host, address.port), family=family_of(address.host))
        # The backlog also limits the connections that asyncio accepts in one turn of the loop.
        opening = self.loop.create_server(lambda: _TcpClient(self), sock=self._listener, backlog=_MAX_CLIENTS)
        self._opening = self.loop.create_task(opening)

    def send(self, peer: Peer, data: bytes) -> None:
        client = self._clients.get(peer)
        if client is not None:
            client.send(data)

    def close(self) -> None:
        if not self._opening.cancel():
            self._opening.result().close()
        self._listener.close()
        for client in self._clients.values():
            client.transport.abort()
        self._clients.clear()

    def joined(self, client: "_TcpClient", sender: tuple[str, int]) -> Peer:
        if len(self._clients) >= _MAX_CLIENTS:
            # Of the machine with the most connections one that has not sent anything, or the one silent for longest.
            connections = Counter(peer.host for peer in self._clients)
            displaced, former = max(
                self._clients.items(),
                key=lambda each: (connections[each[0].host], -each[1].heard_at),
            )
            warn_once(
                self._warned, "gcs.too_many_clients", link=self.name, displaced=str(displaced), limit=_MAX_CLIENTS
            )
            former.transport.abort()
            self.left(displaced, former)
        peer = Peer(self.name, sender)
        self._clients[peer] = client
        # A TCP client hears the vehicle from the start: it may wait for a heartbeat before it speaks.
        self._events.add_default_peer(peer)
        return peer

    def received(self, peer: Peer, client: "_TcpClient", data: bytes) -> None:
        client.heard_at = self.loop.time()
        self._events.gcs_data(peer, data, datagram=False)

    def left(self, peer: Peer, client: "_TcpClient") -> None:
        if self._clients.get(peer) is client:
            del self._clients[peer]
            self._events.remove_default_peer(peer)
            self._events.gcs_gone(peer)


class _TcpClient(asyncio.BufferedProtocol):
    """One connection. `heard_at`: when it last sent bytes, on the loop's clock, or minus infinity at first."""

    transport: asyncio.Transport

    def __init__(self, link: TcpLink) -> None:
        self._link = link
        self._buffer = bytearray(_READ_SIZE)
        self.heard_at = -inf

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        connection = transport.get_extra_info("socket")
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _STALL_MS)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BUFFER)
        self._peer = self._link.joined(self, transport.get_extra_info("peername") or ("", 0))

    def connection_lost(self, exc: Exception | None) -> None:
        self._link.left(self._peer, self)

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        self._link.received(self._peer, self, bytes(self._buffer[:nbytes]))

    def send(self, data: bytes) -> None:
        """Send whole frames. Above a limit of unsent bytes telemetry is dropped."""
        unsent = self.transport.get_write_buffer_size()
        if self.transport.is_closing() or (unsent > _MAX_UNSENT and not must_arrive(data)):
            return
        self.transport.write(data)
        if unsent > 2 * _MAX_UNSENT:
            # With this many unread replies, another would be useless.
            self.transport.abort()
