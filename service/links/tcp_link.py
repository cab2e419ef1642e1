# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations over TCP."""

import asyncio
import errno
import socket
from collections import Counter
from collections.abc import Callable
from functools import partial

from bridge.gcs.station import Peer
from service.links.gcs_events import GcsEvents
from service.links.send_queue import SendQueue
from service.machine.log_setup import warn_once
from service.settings.addresses import GcsAddress, bindable, family_of

#: Small, so that the requests of a client that floods do not delay those of others.
_READ_SIZE = 512
#: Unsent bytes for a stalled client. Above this its telemetry is dropped, oldest first.
_MAX_UNSENT = 65536
_KERNEL_BUFFER = 32768
#: A client that acknowledges nothing for this long is lost: out of Wi-Fi range it cannot close the connection.
_STALL_MS = 60000
#: Each costs a copy of the telemetry.
_MAX_CLIENTS = 32
#: The pause after the system has run out of file descriptors or memory.
_EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_REST_S = 1.0


class TcpLink:
    """tcpin: ground stations connect."""

    def __init__(self, address: GcsAddress, events: GcsEvents) -> None:
        self.name = str(address)
        self._events = events
        self._loop = asyncio.get_running_loop()
        self._clients: dict[Peer, _TcpClient] = {}
        self._warned: set[str] = set()
        self._socket = socket.create_server(bindable(address.host, address.port), family=family_of(address.host))
        self._socket.setblocking(False)
        self._resting: asyncio.TimerHandle | None = None
        self._listen()

    def _listen(self) -> None:
        self._loop.add_reader(self._socket.fileno(), self._acceptable)

    def send(self, peer: Peer, data: bytes) -> None:
        client = self._clients.get(peer)
        if client is not None:
            client.send(data)

    def close(self) -> None:
        if self._resting is not None:
            self._resting.cancel()
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()
        for client in self._clients.values():
            client.close()
        self._clients.clear()

    def _acceptable(self) -> None:
        try:
            connection, sender = self._socket.accept()
        except OSError as error:
            if error.errno in _EXHAUSTED:
                # The client stays in the backlog and would wake the loop again at once.
                self._loop.remove_reader(self._socket.fileno())
                self._resting = self._loop.call_later(_REST_S, self._listen)
            return
        if len(self._clients) >= _MAX_CLIENTS:
            # Of the machine with the most connections one that has sent nothing, or the one silent for longest.
            connections = Counter(peer.host for peer in self._clients)
            displaced, _ = max(
                self._clients.items(),
                key=lambda each: (connections[each[0].host], not each[1].has_sent, -each[1].heard_at),
            )
            warn_once(
                self._warned, "gcs.too_many_clients", link=self.name, displaced=str(displaced), limit=_MAX_CLIENTS
            )
            self._clients[displaced].close()
            self._forget(displaced)
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _STALL_MS)
        # The kernel would buffer minutes of old telemetry for a client that does not read.
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BUFFER)
        peer = Peer(self.name, sender)
        if (former := self._clients.pop(peer, None)) is not None:
            # The old connection's end was never reported: a laptop was switched off and reconnects from the same port.
            former.close()
            self._events.gcs_gone(peer)
        # A TCP client hears the vehicle from the start: it may wait for a heartbeat before it speaks.
        self._events.add_default_peer(peer)
        received = partial(self._events.gcs_data, peer, datagram=False)
        self._clients[peer] = _TcpClient(connection, self._loop, received, partial(self._forget, peer))

    def _forget(self, peer: Peer) -> None:
        del self._clients[peer]
        self._events.remove_default_peer(peer)
        self._events.gcs_gone(peer)


class _TcpClient:
    """One connection with a bounded amount of unsent bytes. `gone` is called when it ends, but not after `close`."""

    def __init__(
        self,
        connection: socket.socket,
        loop: asyncio.AbstractEventLoop,
        received: Callable[[bytes], None],
        gone: Callable[[], None],
    ) -> None:
        self._socket = connection
        self._loop = loop
        self._received = received
        #: When it last sent bytes, on the loop's clock; at first the time of the connection.
        self.heard_at, self.has_sent = loop.time(), False
        self._gone = gone
        self._unsent = SendQueue(_MAX_UNSENT)
        self._hanging_up: asyncio.Handle | None = None
        loop.add_reader(connection.fileno(), self._readable)

    def send(self, data: bytes) -> None:
        if self._hanging_up is not None:
            return
        if self._unsent:
            if not self._unsent.add(data):
                # With this many unread replies, another one would be useless.
                self._hang_up()
            return
        sent = self._try_send(memoryview(data))
        if sent < len(data):
            self._unsent.add(data)
            self._unsent.sent(sent)
            self._loop.add_writer(self._socket.fileno(), self._writable)

    def close(self) -> None:
        if self._hanging_up is not None:
            self._hanging_up.cancel()
        self._loop.remove_reader(self._socket.fileno())
        self._loop.remove_writer(self._socket.fileno())
        self._socket.close()

    def _hang_up(self) -> None:
        """Close soon, not now: the caller iterates over all clients."""
        if self._hanging_up is None:
            self._hanging_up = self._loop.call_soon(self._end)

    def _end(self) -> None:
        self.close()
        self._gone()

    def _writable(self) -> None:
        while self._unsent:
            sent = self._try_send(self._unsent.first())
            if sent == 0:
                return
            self._unsent.sent(sent)
        self._loop.remove_writer(self._socket.fileno())

    def _try_send(self, data: memoryview) -> int:
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._hang_up()
            return 0

    def _readable(self) -> None:
        try:
            data = self._socket.recv(_READ_SIZE)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self.heard_at, self.has_sent = self._loop.time(), True
            self._received(data)
        else:
            self._hang_up()
