# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet mavlink`: one vehicle's MAVLink between zenoh and local ground stations."""

import asyncio
from collections.abc import Callable, Mapping, Sequence

import zenoh

from bridge.gcs.station import Peer
from payloads.keys import MAVLINK_IN, MAVLINK_OUT, full
from service.links.gcs_links import GcsLink, open_link
from service.machine.threads import post
from service.settings.addresses import GcsAddress

#: The router reports a vehicle's subscription within this time.
_FIRST_MATCH_S = 2.0


class GcsRelay:
    """Implements GcsEvents. Must be made on a running event loop; LinkError if a link cannot be opened.

    Frames are passed on whole and undecoded, to every station that was heard or that the address names.
    `on_input`: called with False if the vehicle does not accept frames, or is gone; with True when it does again.
    """

    def __init__(
        self,
        session: zenoh.Session,
        prefix: str,
        vehicle: str,
        gcs: Sequence[GcsAddress],
        on_input: Callable[[bool], None],
    ) -> None:
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
        self._on_input = on_input
        self._accepts_input: bool | None = None
        self._matching = self._input.declare_matching_listener(
            lambda status: post(self._loop, self._input_is, status.matching)
        )
        # A vehicle that never accepted frames causes no event.
        self._loop.call_later(_FIRST_MATCH_S, lambda: self._input_is(self._accepts_input is True))
        self._output = session.declare_subscriber(full(prefix, vehicle, MAVLINK_OUT.suffix), self._heard)

    def close(self) -> None:
        self._output.undeclare()  # type: ignore[no-untyped-call]
        for link in self._links.values():
            link.close()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        self._peers[peer] = None
        self._input.put(data)

    def gcs_gone(self, peer: Peer) -> None:
        self._peers.pop(peer, None)

    remove_default_peer = gcs_gone

    def displaced(self, peers: Mapping[Peer, float]) -> Peer:
        """The longest-silent connection."""
        return min(peers, key=peers.__getitem__)

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        self._peers[peer] = None

    def _input_is(self, accepted: bool) -> None:
        was_refused, self._accepts_input = self._accepts_input is False, accepted
        if was_refused is accepted:
            self._on_input(accepted)

    def _heard(self, sample: zenoh.Sample) -> None:
        post(self._loop, self._send, sample.payload.to_bytes())

    def _send(self, data: bytes) -> None:
        for peer in list(self._peers):
            self._links[peer.link].send(peer, data)
