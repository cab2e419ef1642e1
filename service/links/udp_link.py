# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations over UDP."""

import asyncio
import socket
from functools import partial

import structlog

from bridge.gcs.station import Peer
from service.links.gcs_events import GcsEvents
from service.machine.log_setup import warn_once
from service.machine.threads import BackgroundThread
from service.settings.addresses import UNKNOWN_HOST_HINT, GcsAddress, bindable, family_of
from storage.os_error import reason

_DATAGRAM_SIZE = 2048
#: Datagrams taken in one wake-up, so that a flood cannot starve the flight controller's port.
_DATAGRAMS_AT_ONCE = 64
#: Bytes of datagrams waiting to be read; the kernel may allow less. A flood drops the pilot's when it is full.
_KERNEL_BUFFER = 1 << 20
#: How often a host name is resolved again.
_LOOK_UP_S = 10.0

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
        """Send one datagram, or drop it: MAVLink repeats the important ones."""
        try:
            self._socket.sendto(data, peer.key)  # type: ignore[call-overload]
        except BlockingIOError:
            pass
        except OSError as error:
            # While Wi-Fi is down, every datagram fails.
            warn_once(self._warned, "gcs.send_failed", peer=str(peer), why=reason(error))

    def close(self) -> None:
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
            self._socket.bind(bindable(host, port))
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
                why = f"{reason(error)}; {UNKNOWN_HOST_HINT}"
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
        for _ in range(_DATAGRAMS_AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(_DATAGRAM_SIZE)
            except OSError:
                return  # none is left
            self._events.gcs_data(Peer(self.name, sender), data, datagram=True)
