# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's connections to ground stations: the open links, and the traffic of each."""

import asyncio
from collections.abc import Callable, Mapping, Sequence

import structlog

from bridge.bridge import Bridge
from bridge.gcs.station import Datagrams, Peer
from service.links.gcs_links import GcsLink, LinkError, open_link
from service.links.traffic import Traffic
from service.machine.package import page
from service.settings.addresses import GcsAddress

_WHO_MAY_WRITE = f"anyone on this network can change missions and parameters; to restrict it: {page('docs/signing.md')}"

_log = structlog.get_logger()


class GcsConnections:
    """Feeds the links' bytes to the bridge. Implements service.links.gcs_events.GcsEvents.

    `flush` carries out the bridge's effects.
    """

    def __init__(self, bridge: Bridge, traffic: Mapping[str, Traffic], flush: Callable[[], None]) -> None:
        self._bridge = bridge
        self._traffic = traffic
        self._flush = flush
        self._loop = asyncio.get_running_loop()
        self._links: dict[str, GcsLink] = {}
        self.is_connected = bridge.is_connected
        self.add_default_peer = bridge.add_default_peer
        self.remove_default_peer = bridge.remove_default_peer

    def open(self, address: GcsAddress) -> None:
        """Open a link. Raises LinkError if that fails."""
        self.add(open_link(address, self))

    def warn(self, address: GcsAddress) -> None:
        if not address.is_serial:
            _log.warning("gcs.open", link=str(address), what=_WHO_MAY_WRITE)

    def add(self, link: GcsLink) -> None:
        self._links[link.name] = link

    def change(self, old: Sequence[GcsAddress], new: Sequence[GcsAddress]) -> tuple[GcsAddress, ...]:
        """Replace links. Those that stay are not interrupted. Returns those open."""
        for address in old:
            if address not in new and (link := self._links.get(str(address))) is not None:
                self._bridge.link_closed(link.name, self._loop.time())
                self._flush()
                del self._links[link.name]
                link.close()
                _log.info("gcs.closed", link=link.name)
        for address in new:
            if str(address) not in self._links:
                try:
                    self.open(address)
                except LinkError as error:
                    _log.error("gcs.unavailable", link=str(address), why=str(error))
                else:
                    self.warn(address)
        return tuple(address for address in new if str(address) in self._links)

    def send(self, datagrams: Datagrams) -> None:
        for peer, data in datagrams:
            self._links[peer.link].send(peer, data)
            self._traffic[peer.link].bytes_sent += len(data)

    def close(self) -> None:
        for link in self._links.values():
            link.close()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        self._traffic[peer.link].bytes_received += len(data)
        try:
            if not self._bridge.gcs_received(peer, data, self._loop.time(), datagram=datagram):
                return
        except Exception:
            # A ground station must not be able to reset the flight controller's line: only the data is dropped.
            _log.exception("gcs.fault", peer=str(peer))
        self._flush()

    def gcs_gone(self, peer: Peer) -> None:
        self._bridge.gcs_gone(peer, self._loop.time())
        self._flush()
