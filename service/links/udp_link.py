# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations over UDP.

A connected station of an udpin link has a separate socket on the same port, to which the kernel passes only its
datagrams: a flood from others fills the queue of the open socket, not of this socket.
"""

import asyncio
import socket
import struct
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import structlog

from bridge.gcs.station import Peer
from protocols.remedies import Fault
from service.links.gcs_events import GcsEvents
from service.machine.log_setup import warn_once
from service.machine.threads import BackgroundThread
from service.settings.addresses import GcsAddress, bindable, family_of
from storage.os_error import reason

_DATAGRAM_SIZE = 2048
#: Bytes taken in one wake-up, so that a flood cannot starve the flight controller's port. A datagram counts as at least
#: `_LEAST`.
_AT_ONCE, _LEAST = 2048, 32
#: Bytes of datagrams waiting to be read. The kernel may allow less. A flood drops the pilot's when it is full.
_KERNEL_BUFFER = 1 << 20
#: How often a host name is resolved again.
_LOOK_UP_S = 10.0
#: ip(7): an interface, the local address for replies, and the destination address. Not named in this Python's socket.
_IP_PKTINFO, _IN_PKTINFO = 8, struct.Struct("=i4s4s")
#: ipv6(7): the destination address, and an interface.
_IN6_PKTINFO = struct.Struct("=16si")
_ANCILLARY_SIZE = socket.CMSG_SPACE(_IN6_PKTINFO.size)

_log = structlog.get_logger()


class UdpLink:
    """udpin waits for peers, udpout sends to one address, udpbcast to all until one answers."""

    def __init__(self, address: GcsAddress, events: GcsEvents) -> None:
        self.name = str(address)
        self._address = address
        self._family = family_of(address.host)
        self._events = events
        self._loop = asyncio.get_running_loop()
        self._warned: set[str] = set()
        self._lookup: asyncio.Task[None] | None = None
        self._own: dict[Peer, _StationSocket] = {}
        self._socket = socket.socket(self._family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KERNEL_BUFFER)
        try:
            self._set_up()
        except OSError:
            self._socket.close()
            raise
        self._loop.add_reader(self._socket.fileno(), self._readable)

    def send(self, peer: Peer, data: bytes) -> None:
        """Send one datagram, or drop it: MAVLink repeats the important frames."""
        try:
            if (own := self._own.get(peer)) is not None:
                own.send(data)
                return
            self._socket.sendto(data, peer.key)  # type: ignore[call-overload]
        except (BlockingIOError, ConnectionRefusedError):
            pass
        except OSError as error:
            if (own := self._own.pop(peer, None)) is not None:
                # Perhaps our own address has changed.
                own.close()
            # While Wi-Fi is down, every datagram fails.
            warn_once(self._warned, "gcs.send_failed", peer=str(peer), why=reason(error))

    def close(self) -> None:
        if self._lookup is not None:
            self._lookup.cancel()
        for own in self._own.values():
            own.close()
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()

    def _set_up(self) -> None:
        host, port = self._address.host, self._address.port
        if self._family is socket.AF_INET6:
            # Otherwise it would take the port away from udpin:0.0.0.0.
            self._socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        if self._address.kind == "udpin":
            self._socket.bind(bindable(host, port))
            # Only now, so that a second daemon gets an error.
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            if self._family is socket.AF_INET6:
                self._socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_RECVPKTINFO, 1)
            else:
                self._socket.setsockopt(socket.IPPROTO_IP, _IP_PKTINFO, 1)
            return
        broadcast = self._address.kind == "udpbcast"
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, broadcast)
        try:
            found = socket.getaddrinfo(host, port, self._family, socket.SOCK_DGRAM, flags=socket.AI_NUMERICHOST)
        except socket.gaierror:
            resolver = BackgroundThread("name lookup")
            self._lookup = self._loop.create_task(self._follow_name(resolver, until_answered=broadcast))
            self._lookup.add_done_callback(lambda _: resolver.close(0))
        else:
            self._events.add_default_peer(Peer(self.name, found[0][4]), until_answered=broadcast)

    async def _follow_name(self, resolver: BackgroundThread, *, until_answered: bool) -> None:
        """Send to the address of a host name: the network may come up later, and a laptop's address may change."""
        look_up = partial(socket.getaddrinfo, self._address.host, self._address.port, self._family, socket.SOCK_DGRAM)
        known: Peer | None = None
        while True:
            try:
                found = await resolver.ask(look_up)
            except OSError as error:
                why = Fault.UNKNOWN_HOST.text(why=reason(error))
                warn_once(self._warned, "gcs.name_unknown", link=self.name, why=why)
            else:
                peers = [Peer(self.name, entry[4]) for entry in found]
                self._warned.discard("gcs.name_unknown")
                if known not in peers:
                    if known is not None:
                        self._events.remove_default_peer(known)
                    known = peers[0]
                    self._events.add_default_peer(known, until_answered=until_answered)
                    _log.info("gcs.name_found", peer=str(known))
            await asyncio.sleep(_LOOK_UP_S)

    def _readable(self) -> None:
        left = _AT_ONCE
        while left > 0:
            try:
                data, ancillary, _, sender = self._socket.recvmsg(_DATAGRAM_SIZE, _ANCILLARY_SIZE)
            except OSError:
                return  # none is left
            left -= max(len(data), _LEAST)
            peer = Peer(self.name, sender)
            self._events.gcs_data(peer, data, datagram=True)
            if ancillary and peer not in self._own and self._events.is_connected(peer):
                self._open_own(peer, _local_address(ancillary, self._address.port))

    def _open_own(self, peer: Peer, local: tuple[str | int, ...]) -> None:
        """Open a socket for a station, on the address that it sends to, and close those of stations that have left."""
        for left in [each for each in self._own if not self._events.is_connected(each)]:
            self._own.pop(left).close()
        with suppress(OSError):  # it is served over the open socket
            self._own[peer] = _StationSocket(self._family, local, peer, self._loop, self._received)

    def _received(self, sender: Any, data: bytes) -> None:
        self._events.gcs_data(Peer(self.name, sender), data, datagram=True)


class _StationSocket:
    """A connected socket. `received` is called with a sender and a datagram."""

    def __init__(
        self,
        family: socket.AddressFamily,
        local: tuple[str | int, ...],
        peer: Peer,
        loop: asyncio.AbstractEventLoop,
        received: Callable[[Any, bytes], None],
    ) -> None:
        self._loop = loop
        self._received = received
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            if family is socket.AF_INET6:
                self._socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            self._socket.bind(local)
            self._socket.connect(peer.key)  # type: ignore[arg-type]
        except OSError:
            self._socket.close()
            raise
        #: ConnectionRefusedError: the previous datagram came to a closed port, and the station may start again.
        self.send = self._socket.send
        loop.add_reader(self._socket.fileno(), self._readable)

    def close(self) -> None:
        self._loop.remove_reader(self._socket.fileno())
        self._socket.close()

    def _readable(self) -> None:
        left = _AT_ONCE
        while left > 0:
            try:
                # Before the socket was connected, datagrams of others may have arrived.
                data, sender = self._socket.recvfrom(_DATAGRAM_SIZE)
            except OSError:
                return
            left -= max(len(data), _LEAST)
            self._received(sender, data)


def _local_address(ancillary: Sequence[tuple[int, int, bytes]], port: int) -> tuple[str | int, ...]:
    """The local address that a datagram was sent to, for bind()."""
    ((level, _, data),) = ancillary
    if level == socket.IPPROTO_IP:
        _, address, _ = _IN_PKTINFO.unpack(data)
        return socket.inet_ntoa(address), port
    address, interface = _IN6_PKTINFO.unpack(data)
    return socket.inet_ntop(socket.AF_INET6, address), port, 0, interface
