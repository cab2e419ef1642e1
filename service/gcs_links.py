"""Ground stations over UDP and TCP. Nothing here ever waits for a slow peer."""

import asyncio
import errno
import socket
from collections.abc import Callable
from typing import Protocol

import structlog

from bridge.station import Peer
from service.connection import GcsAddress
from service.send_queue import SendQueue

_DATAGRAM_SIZE = 2048
#: Datagrams taken in one wake-up, so that a flood cannot starve the flight controller's port.
_DATAGRAMS_AT_ONCE = 64
#: What a stalled TCP client may leave unread; then telemetry for it is dropped, the oldest first.
_MAX_UNSENT = 65536
_KERNEL_BUFFER = 32768

_log = structlog.get_logger()


class LinkError(Exception):
    """A link cannot be set up; the text is one sentence for the user."""


class GcsEvents(Protocol):
    """What a link tells the daemon."""

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        """Bytes came; a datagram holds whole frames."""

    def gcs_gone(self, peer: Peer) -> None:
        """A connection was closed."""

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """`peer` is spoken to before it was heard; or only as long as nobody on its link was heard."""

    def remove_default_peer(self, peer: Peer) -> None:
        """It is not any more."""


class GcsLink(Protocol):
    """One --gcs connection."""

    name: str

    def send(self, peer: Peer, data: bytes) -> None:
        """Send without waiting; drop what cannot go."""

    def close(self) -> None:
        """Close its sockets."""


def open_link(address: GcsAddress, events: GcsEvents) -> GcsLink:
    """Set a link up; LinkError says why that is impossible."""
    try:
        if address.kind == "tcpin":
            return TcpLink(address, events)
        return UdpLink(address, events)
    except OSError as error:
        hint = "; stop the program that has it, or name another port" if error.errno == errno.EADDRINUSE else ""
        raise LinkError(f"{address} cannot be opened: {error.strerror or error}{hint}") from error


class UdpLink:
    """udpin waits to be spoken to, udpout speaks to one address, udpbcast to all until somebody answers."""

    def __init__(self, address: GcsAddress, events: GcsEvents) -> None:
        self.name = str(address)
        self._events = events
        self._loop = asyncio.get_running_loop()
        self._complained = False
        found = socket.getaddrinfo(address.host, address.port, socket.AF_INET, socket.SOCK_DGRAM)
        resolved: tuple[str, int] = (str(found[0][4][0]), address.port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            if address.kind == "udpin":
                self._socket.bind(resolved)
            else:
                broadcast = address.kind == "udpbcast"
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, broadcast)
                events.add_default_peer(Peer(self.name, resolved), until_answered=broadcast)
        except OSError:
            self._socket.close()
            raise
        self._loop.add_reader(self._socket.fileno(), self._readable)

    def send(self, peer: Peer, data: bytes) -> None:
        """Send one datagram, or drop it: MAVLink repeats what matters."""
        try:
            self._socket.sendto(data, peer.key)  # type: ignore[call-overload]
        except BlockingIOError:
            pass
        except OSError as error:
            # Wi-Fi that is down says so with every datagram.
            level = _log.debug if self._complained else _log.warning
            level("gcs.send_failed", peer=str(peer), why=error.strerror or str(error))
            self._complained = True

    def close(self) -> None:
        """Close the socket."""
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()

    def _readable(self) -> None:
        for _ in range(_DATAGRAMS_AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(_DATAGRAM_SIZE)
            except BlockingIOError:
                return
            except OSError:
                # An ICMP "port unreachable" for something we sent; the ground station is just not there yet.
                continue
            self._events.gcs_data(Peer(self.name, sender), data, datagram=True)


class TcpLink:
    """tcpin: any number of ground stations connect."""

    def __init__(self, address: GcsAddress, events: GcsEvents) -> None:
        self.name = str(address)
        self._events = events
        self._loop = asyncio.get_running_loop()
        self._clients: dict[Peer, _TcpClient] = {}
        self._socket = socket.create_server((address.host, address.port), family=socket.AF_INET)
        self._socket.setblocking(False)
        self._loop.add_reader(self._socket.fileno(), self._acceptable)

    def send(self, peer: Peer, data: bytes) -> None:
        """Send to one client."""
        client = self._clients.get(peer)
        if client is not None:
            client.send(data)

    def close(self) -> None:
        """Close the server and its clients."""
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()
        for client in list(self._clients.values()):
            client.close()

    def _acceptable(self) -> None:
        try:
            connection, sender = self._socket.accept()
        except OSError:
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # The kernel would keep minutes of old telemetry for who does not read.
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BUFFER)
        peer = Peer(self.name, sender)
        # A TCP client hears the vehicle from the start: it may wait for a heartbeat before it speaks.
        self._events.add_default_peer(peer)

        def received(data: bytes) -> None:
            self._events.gcs_data(peer, data, datagram=False)

        def gone() -> None:
            del self._clients[peer]
            self._events.remove_default_peer(peer)
            self._events.gcs_gone(peer)

        self._clients[peer] = _TcpClient(connection, self._loop, received, gone)


class _TcpClient:
    """One connection with a bounded amount of unsent bytes."""

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
        self._gone = gone
        self._unsent = SendQueue(_MAX_UNSENT)
        loop.add_reader(connection.fileno(), self._readable)

    def send(self, data: bytes) -> None:
        if self._unsent:
            if not self._unsent.add(data):
                # It has not read so many answers that it can make no sense of the next one.
                self.close()
            return
        sent = self._try_send(memoryview(data))
        if sent < len(data) and self._socket.fileno() >= 0:
            self._unsent.add(data)
            self._unsent.sent(sent)
            self._loop.add_writer(self._socket.fileno(), self._writable)

    def close(self) -> None:
        if self._socket.fileno() < 0:
            return
        self._loop.remove_reader(self._socket.fileno())
        self._loop.remove_writer(self._socket.fileno())
        self._socket.close()
        self._unsent = SendQueue(_MAX_UNSENT)
        self._gone()

    def _writable(self) -> None:
        while self._unsent:
            first = self._unsent.first()
            sent = self._try_send(first)
            if self._socket.fileno() < 0:
                return
            if sent == 0:
                return
            self._unsent.sent(sent)
        self._loop.remove_writer(self._socket.fileno())

    def _try_send(self, data: memoryview) -> int:
        try:
            return self._socket.send(data)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError:
            self.close()
            return 0

    def _readable(self) -> None:
        try:
            data = self._socket.recv(_DATAGRAM_SIZE)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._received(data)
        else:
            self.close()
