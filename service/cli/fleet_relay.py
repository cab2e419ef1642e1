# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet mavlink` while it runs: the MAVLink of vehicles between zenoh and local ground stations, and the messages."""

import asyncio
from collections.abc import Sequence
from math import inf

import click
import zenoh

from bridge.gcs.station import Datagrams, Peer
from bridge.relay import Relays, SameSystem, SendToVehicle, WriteList
from fleet.enrolment import SYSIDS
from fleet.session import FleetError
from fleet.tables import in_few_words
from fleet.vehicle import BridgeId, bridge_of
from payloads.keys import ALIVE, full
from service.cli.vehicle_relay import VehicleRelay
from service.links.gcs_links import GcsLink, open_link
from service.machine.host import Host
from service.machine.own_networks import OwnNetworks
from service.machine.threads import post
from service.settings.addresses import GcsAddress

_READ_ONLY = "accepts no MAVLink: zenoh.mavlink_in is off there, or the router denies access"
#: Every vehicle sends a heartbeat once a second.
_FIRST_HEARTBEAT_S = 5.0
_LOOK_S = 0.1
#: The end of a vehicle's subscription may be known this long before the end of the token.
_LEFT_S = 1.0


async def relay_fleet(
    session: zenoh.Session,
    prefix: str,
    names: Sequence[str],
    bridges: set[BridgeId],
    gcs: Sequence[GcsAddress],
    *,
    is_all: bool,
) -> None:
    """Relay vehicles until cancelled. `bridges`: those alive. `is_all`: also vehicles that appear later.

    FleetError if vehicles share a system id or there are more than ids. Raises LinkError if a link cannot be opened.
    """
    if len(names) > len(SYSIDS):
        raise FleetError(f"MAVLink has ids for {len(SYSIDS)} vehicles, not for {len(names):,}: use --vehicle")
    relay = FleetRelay(session, prefix, bridges, gcs, is_all=is_all)
    try:
        for name in names:
            relay.add(name)
        await relay.start(names, ", ".join(map(str, gcs)))
        await asyncio.Event().wait()
    finally:
        relay.close()


class FleetRelay:
    """The vehicles and the links to ground stations. Implements GcsEvents."""

    def __init__(
        self, session: zenoh.Session, prefix: str, bridges: set[BridgeId], gcs: Sequence[GcsAddress], *, is_all: bool
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._session, self._prefix, self._bridges, self._is_all = session, prefix, bridges, is_all
        self._relays = Relays(OwnNetworks(Host()))
        self._vehicles: dict[str, VehicleRelay] = {}
        self._clash = ""
        self._is_started = False
        self.add_default_peer = self._relays.add_default_peer
        self.remove_default_peer = self._relays.remove_default_peer
        self._timer: asyncio.TimerHandle | None = None
        self._links: dict[str, GcsLink] = {}
        for address in gcs:
            link = open_link(address, self)
            self._links[link.name] = link
        self._tokens = session.liveliness().declare_subscriber(
            full(prefix, "*", f"{ALIVE}/*"), lambda sample: post(self._loop, self._token, sample), history=True
        )

    async def start(self, names: Sequence[str], where: str) -> None:
        """Wait for all to be heard: until then their ids are unknown."""
        if len(names) > 1:
            for _ in range(round(_FIRST_HEARTBEAT_S / _LOOK_S)):
                if self._clash or self._relays.heard.issuperset(names):
                    break
                await asyncio.sleep(_LOOK_S)
        if self._clash:
            raise FleetError(self._clash)
        self._is_started = True
        title = f"{names[0]} is" if len(names) == 1 else f"{len(names)} vehicles are"
        click.echo(f"{title} at {where}. Ctrl-C ends.")
        if len(names) > 1 and (unheard := [name for name in names if name not in self._relays.heard]):
            click.echo(f"No MAVLink yet from {in_few_words(unheard)}", err=True)

    def add(self, name: str) -> None:
        """Connect a vehicle."""
        if name not in self._vehicles:
            self._relays.add(name)
            self._vehicles[name] = VehicleRelay(
                self._session, self._prefix, name, self._bridges, self._relays, self._sent, self._input_changed
            )

    def close(self) -> None:
        self._tokens.undeclare()  # type: ignore[no-untyped-call]
        if self._timer is not None:
            self._timer.cancel()
        for name in [*self._vehicles]:
            self._remove(name)
        for link in self._links.values():
            link.close()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        self._relays.gcs_received(peer, data, self._loop.time(), datagram=datagram)
        self._flush()

    def is_connected(self, _peer: Peer) -> bool:
        """A socket for each station would not help on a machine with more memory and speed than a Pi."""
        return False

    def gcs_gone(self, peer: Peer) -> None:
        self._relays.gcs_gone(peer, self._loop.time())

    def _remove(self, name: str) -> None:
        self._relays.remove(name)
        if (vehicle := self._vehicles.pop(name, None)) is not None:
            vehicle.close()

    def _token(self, sample: zenoh.Sample) -> None:
        bridge = bridge_of(str(sample.key_expr), self._prefix)
        if bridge is None:
            return
        was_alive = self._is_alive(bridge.vehicle)
        if sample.kind == zenoh.SampleKind.PUT:
            self._bridges.add(bridge)
            if not was_alive and bridge.vehicle in self._vehicles:
                click.echo(f"{bridge.vehicle} is back", err=True)
            elif self._is_all and len(self._relays.heard) < len(SYSIDS):
                self.add(bridge.vehicle)
            return
        self._bridges.discard(bridge)
        if was_alive and not self._is_alive(bridge.vehicle) and bridge.vehicle in self._vehicles:
            click.echo(f"{bridge.vehicle} has left", err=True)
            if self._is_all:
                self._remove(bridge.vehicle)

    def _is_alive(self, name: str) -> bool:
        return name in {bridge.vehicle for bridge in self._bridges}

    def _input_changed(self, name: str, accepts: bool) -> None:
        self._loop.call_later(_LEFT_S, self._tell_input, name, accepts)

    def _tell_input(self, name: str, accepts: bool) -> None:
        if self._is_alive(name):
            click.echo(f"{name} {'accepts MAVLink again' if accepts else _READ_ONLY}", err=True)

    def _left_out(self, name: str, other: str, system: int) -> None:
        self._vehicles.pop(name).close()
        self._clash = f"{name} and {other} both have system id {system}: give each its own sysid (fleet enroll does)"
        if self._is_started:
            click.echo(f"{self._clash}; {name} is left out", err=True)

    def _sent(self, name: str, data: bytes) -> None:
        """Frames of a vehicle, or none: its relay has something to send."""
        self._relays.vehicle_received(name, data, self._loop.time())
        self._flush()

    def _flush(self) -> None:
        for name, effect in self._relays.take():
            match effect:
                case Datagrams():
                    for peer, data in effect:
                        self._links[peer.link].send(peer, data)
                case SendToVehicle(frame):
                    self._vehicles[name].send(frame)
                case WriteList(items):
                    self._vehicles[name].write(items)
                case SameSystem(other, system):
                    self._left_out(name, other, system)
        if self._timer is not None:
            self._timer.cancel()
        due = self._relays.due
        self._timer = None if due == inf else self._loop.call_at(due, self._tick)

    def _tick(self) -> None:
        self._relays.tick(self._loop.time())
        self._flush()
