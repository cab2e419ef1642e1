# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet mavlink`: one vehicle's MAVLink between zenoh and local ground stations."""

import asyncio
from collections.abc import Mapping, Sequence

import zenoh

from bridge.gcs.station import Peer
from bridge.gcs.stations import displaced
from service.links.gcs_links import GcsLink, open_link
from service.machine.threads import post
from service.settings.addresses import GcsAddress
from service.zenoh_link.keys import MAVLINK_IN, MAVLINK_OUT, full


class GcsRelay:
    """Implements GcsEvents. Must be made on a running event loop; LinkError if a link cannot be opened.

    Frames are passed on whole and undecoded, to every station that was heard or that the address names.
    """

    def __init__(self, session: zenoh.Session, prefix: str, vehicle: str, gcs: Sequence[GcsAddress]) -> None:
        self._loop = asyncio.get_running_loop()
        self._peers: dict[Peer, None] = {}
        self._links: dict[str, GcsLink] = {}
        for address in gcs:
            link = open_link(address, self)
            self._links[link.name] = link
        self._input = session.declare_publisher(
            full(prefix, vehicle, MAVLINK_IN.suffix),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_HIGH,
        )
        self._output = session.declare_subscriber(full(prefix, vehicle, MAVLINK_OUT.suffix), self._heard)

    def close(self) -> None:
        """Undeclare the keys and close the links."""
        self._output.undeclare()  # type: ignore[no-untyped-call]
        for link in self._links.values():
            link.close()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        """Pass a ground station's frames on to the vehicle."""
        self._peers[peer] = None
        self._input.put(data)

    def gcs_gone(self, peer: Peer) -> None:
        """Forget a station."""
        self._peers.pop(peer, None)

    def displaced(self, peers: Mapping[Peer, float]) -> Peer:
        """The connection of a full link to close."""
        return displaced(peers)

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """Send to a station before it is heard."""
        self._peers[peer] = None

    def remove_default_peer(self, peer: Peer) -> None:
        """Stop sending to it."""
        self._peers.pop(peer, None)

    def _heard(self, sample: zenoh.Sample) -> None:
        post(self._loop, self._send, sample.payload.to_bytes())

    def _send(self, data: bytes) -> None:
        for peer in list(self._peers):
            self._links[peer.link].send(peer, data)
