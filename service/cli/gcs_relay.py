# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet mavlink`: the MAVLink of vehicles between zenoh and local ground stations."""

import asyncio
from collections.abc import Callable, Container, Mapping, Sequence
from math import inf

import zenoh

from bridge.gcs.station import Peer
from bridge.relays import Relays
from fleet.vehicle import BridgeId
from service.cli.vehicle_relay import VehicleRelay
from service.links.gcs_links import GcsLink, open_link
from service.settings.addresses import GcsAddress


class GcsRelay:
    """Implements GcsEvents. Must be made on a running event loop; LinkError if a link cannot be opened.

    `on_input`: called with a vehicle's name and False if it does not accept frames, or is gone; with True when it does
    again. `clashes`: see Relays.
    """

    def __init__(
        self,
        session: zenoh.Session,
        prefix: str,
        gcs: Sequence[GcsAddress],
        on_input: Callable[[str, bool], None],
        clashes: Callable[[str, str, int], object],
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._session, self._prefix, self._on_input = session, prefix, on_input
        self._relays, self._clashes = Relays(self._left_out), clashes
        self._vehicles: dict[str, VehicleRelay] = {}
        self.add_default_peer = self._relays.add_default_peer
        self.remove_default_peer = self._relays.remove_default_peer
        self._timer: asyncio.TimerHandle | None = None
        self._links: dict[str, GcsLink] = {}
        for address in gcs:
            link = open_link(address, self)
            self._links[link.name] = link

    @property
    def heard(self) -> set[str]:
        """The vehicles that were heard."""
        return self._relays.heard

    def add(self, name: str, bridges: Container[BridgeId]) -> None:
        """Connect a vehicle. `bridges`: those that are alive, also later."""
        if name in self._vehicles:
            return
        vehicle = VehicleRelay(self._session, self._prefix, name, bridges, self._vehicle_sent, self._on_input)
        self._vehicles[name] = vehicle
        self._relays.add(name, vehicle.relay)

    def remove(self, name: str) -> None:
        """Disconnect a vehicle."""
        self._relays.remove(name)
        if (vehicle := self._vehicles.pop(name, None)) is not None:
            vehicle.close()

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        for name in [*self._vehicles]:
            self.remove(name)
        for link in self._links.values():
            link.close()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        self._relays.gcs_received(peer, data, self._loop.time(), datagram=datagram)
        self._flush()

    def gcs_gone(self, peer: Peer) -> None:
        self._relays.gcs_gone(peer, self._loop.time())

    def displaced(self, peers: Mapping[Peer, float]) -> Peer:
        """The longest-silent connection."""
        return min(peers, key=peers.__getitem__)

    def _vehicle_sent(self, name: str, data: bytes) -> None:
        """Frames of a vehicle, or none: its relay has something to send."""
        self._relays.vehicle_received(name, data, self._loop.time())
        self._flush()

    def _left_out(self, name: str, other: str, system: int) -> None:
        self._vehicles.pop(name).close()
        self._clashes(name, other, system)

    def _flush(self) -> None:
        for peer, data in self._relays.take_datagrams():
            self._links[peer.link].send(peer, data)
        if self._timer is not None:
            self._timer.cancel()
        due = self._relays.due
        self._timer = None if due == inf else self._loop.call_at(due, self._tick)

    def _tick(self) -> None:
        self._relays.tick(self._loop.time())
        self._flush()
