# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet mavlink` while it runs: the vehicles at the ground stations, those that join and leave, and its messages."""

import asyncio
from collections.abc import Sequence

import click
import zenoh

from fleet.enrolment import SYSIDS
from fleet.session import FleetError
from fleet.tables import in_few_words
from fleet.vehicle import BridgeId, bridge_of
from payloads.keys import ALIVE, full
from service.cli.gcs_relay import GcsRelay
from service.machine.threads import post
from service.settings.addresses import GcsAddress

_READ_ONLY = "accepts no MAVLink: zenoh.mavlink_in is off there, the router denies access, or it is not connected"
#: Every vehicle sends a heartbeat once a second.
_FIRST_HEARTBEAT_S = 5.0
_LOOK_S = 0.1


class FleetRelay:
    """Relays these vehicles. `bridges`: those alive. `is_all`: also vehicles that appear later, until they leave."""

    def __init__(
        self, session: zenoh.Session, prefix: str, names: Sequence[str], bridges: set[BridgeId], *, is_all: bool
    ) -> None:
        self._session, self._prefix, self._bridges = session, prefix, bridges
        self._names, self._is_all = names, is_all
        self._clash = ""
        self._is_started = False

    async def run(self, gcs: Sequence[GcsAddress]) -> None:
        """Relay until cancelled. FleetError if vehicles share a system id or there are more than ids; LinkError."""
        if len(self._names) > len(SYSIDS):
            raise FleetError(f"MAVLink has ids for {len(SYSIDS)} vehicles, not for {len(self._names):,}: use --vehicle")
        loop = asyncio.get_running_loop()
        relay = GcsRelay(self._session, self._prefix, gcs, _input_changed, self._clashes)
        tokens = self._session.liveliness().declare_subscriber(
            full(self._prefix, "*", f"{ALIVE}/*"), lambda sample: post(loop, self._token, relay, sample), history=True
        )
        try:
            for name in self._names:
                relay.add(name, self._bridges)
            await self._start(relay, ", ".join(map(str, gcs)))
            await asyncio.Event().wait()
        finally:
            tokens.undeclare()  # type: ignore[no-untyped-call]
            relay.close()

    async def _start(self, relay: GcsRelay, where: str) -> None:
        """Wait for all to be heard: until then their ids are unknown."""
        if len(self._names) > 1:
            for _ in range(round(_FIRST_HEARTBEAT_S / _LOOK_S)):
                if self._clash or relay.heard.issuperset(self._names):
                    break
                await asyncio.sleep(_LOOK_S)
        if self._clash:
            raise FleetError(self._clash)
        self._is_started = True
        title = f"{self._names[0]} is" if len(self._names) == 1 else f"{len(self._names)} vehicles are"
        click.echo(f"{title} at {where}. Ctrl-C ends.")
        if len(self._names) > 1 and (unheard := [name for name in self._names if name not in relay.heard]):
            click.echo(f"No MAVLink yet from {in_few_words(unheard)}", err=True)

    def _token(self, relay: GcsRelay, sample: zenoh.Sample) -> None:
        bridge = bridge_of(str(sample.key_expr), self._prefix)
        if bridge is None:
            return
        if sample.kind == zenoh.SampleKind.PUT:
            self._bridges.add(bridge)
            if self._is_all and len(relay.heard) < len(SYSIDS):
                relay.add(bridge.vehicle, self._bridges)
            return
        self._bridges.discard(bridge)
        if self._is_all and bridge.vehicle not in {each.vehicle for each in self._bridges}:
            relay.remove(bridge.vehicle)
            click.echo(f"{bridge.vehicle} has left", err=True)

    def _clashes(self, name: str, other: str, system: int) -> None:
        self._clash = f"{name} and {other} both have system id {system}: give each its own sysid (fleet enroll does)"
        if self._is_started:
            click.echo(f"{self._clash}; {name} is left out", err=True)


def _input_changed(name: str, accepts: bool) -> None:
    click.echo(f"{name} {'accepts MAVLink again' if accepts else _READ_ONLY}", err=True)
