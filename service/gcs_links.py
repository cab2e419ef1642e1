"""Ground stations over UDP and TCP. Nothing here ever waits for a slow peer."""

import asyncio
import errno
import socket
from collections.abc import Callable
from typing import Protocol

import structlog

from bridge.station import Peer
from service.connection import UNKNOWN_HOST_HINT, GcsAddress, family_of
from service.send_queue import SendQueue

_DATAGRAM_SIZE = 2048
#: Datagrams taken in one wake-up, so that a flood cannot starve the flight controller's port.
_DATAGRAMS_AT_ONCE = 64
#: What a stalled TCP client may leave unread; then telemetry for it is dropped, the oldest first.
_MAX_UNSENT = 65536
_KERNEL_BUFFER = 32768
#: One that has taken nothing for so long is not there any more, though its Wi-Fi could not say so.
_STALL_MS = 60000
#: Each costs a copy of the telemetry.
_MAX_CLIENTS = 32
#: How often it is asked what a name stands for.
_LOOK_UP_S = 10.0

_HINTS = {
    errno.EADDRINUSE: "stop the program that has it, or name another port",
    errno.EADDRNOTAVAIL: "this machine has no such address; 0.0.0.0 is all that it has",
    errno.EACCES: "ports below 1024 are for root; name another port",
}

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
        number = error.errno or 0  # below 0 it is one of getaddrinfo's
        hint = UNKNOWN_HOST_HINT if number < 0 else _HINTS.get(number, "")
        text = f"{address} cannot be opened: {error.strerror or error}"
        raise LinkError(f"{text}; {hint}" if hint else text) from error


class UdpLink:
    """udpin waits to be spoken to, udpout speaks to one address, udpbcast to all until somebody answers."""

    def __init__(self, address: GcsAddress, events: GcsEvents) -> None:
        self.name = str(address)
        self._address = address
        self._family = family_of(address.host)
        self._events = events
        self._loop = asyncio.get_running_loop()
        self._complained = False
        self._lookup: asyncio.Task[None] | None = None
        self._socket = socket.socket(self._family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._set_up()
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
        if self._lookup is not None:
            self._lookup.cancel()
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()

    def _set_up(self) -> None:
        host, port = self._address.host, self._address.port
        if self._family is socket.AF_INET6:
            # Otherwise it would take the port away from udpin:0.0.0.0.
            self._socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        if self._address.kind == "udpin":
            self._socket.bind((host, port))
            return
        broadcast = self._address.kind == "udpbcast"
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, broadcast)
        try:
            found = socket.getaddrinfo(host, port, self._family, socket.SOCK_DGRAM, flags=socket.AI_NUMERICHOST)
        except socket.gaierror:
            self._lookup = self._loop.create_task(self._follow_name(until_answered=broadcast))
        else:
            self._events.add_default_peer(Peer(self.name, found[0][4]), until_answered=broadcast)

    async def _follow_name(self, *, until_answered: bool) -> None:
        """Speak to what the name stands for: a network comes up after us, and a laptop gets another address."""
        known: Peer | None = None
        complained = False
        while True:
            try:
                found = await self._loop.getaddrinfo(
                    self._address.host, self._address.port, family=self._family, type=socket.SOCK_DGRAM
                )
            except OSError as error:
                level = _log.debug if complained else _log.warning
                level("gcs.name_unknown", link=self.name, why=f"{error.strerror or error}; {UNKNOWN_HOST_HINT}")
                complained = True
            else:
                peers = [Peer(self.name, entry[4]) for entry in found]
                complained = False
                if known not in peers:
                    if known is not None:
                        self._events.remove_default_peer(known)
                    known = peers[0]
                    self._events.add_default_peer(known, until_answered=until_answered)
                    _log.info("gcs.name_found", peer=str(known))
            await asyncio.sleep(_LOOK_UP_S)

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
        self._complained = False
        self._socket = socket.create_server((address.host, address.port), family=family_of(address.host))
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
        for client in self._clients.values():
            client.close()
        self._clients.clear()

    def _acceptable(self) -> None:
        try:
            connection, sender = self._socket.accept()
        except OSError:
            return
        if len(self._clients) >= _MAX_CLIENTS:
            connection.close()
            level = _log.debug if self._complained else _log.warning
            level("gcs.too_many_clients", link=self.name, refused=str(sender), limit=_MAX_CLIENTS)
            self._complained = True
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _STALL_MS)
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
    """One connection with a bounded amount of unsent bytes. `gone`: it was closed, but not by `close`."""

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
        self._hanging_up: asyncio.Handle | None = None
        loop.add_reader(connection.fileno(), self._readable)

    def send(self, data: bytes) -> None:
        if self._hanging_up is not None:
            return
        if self._unsent:
            if not self._unsent.add(data):
                # It has not read so many answers that it can make no sense of the next one.
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
        """Close soon: whoever sends is in the middle of sending to others, too."""
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
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError:
            self._hang_up()
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
            self._hang_up()
