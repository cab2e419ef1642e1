# SPDX-License-Identifier: GPL-3.0-or-later
"""Liveliness: the bridge's own token, other bridges that use its name by mistake, and connected sessions."""

import asyncio

import zenoh

from bridge.model.events import BridgeEvent, Emit, Level
from payloads.mission_data import Json
from service.machine.threads import post

RENAME = "give one of the two another zenoh.vehicle"


class NameTaken(BridgeEvent):
    """Another bridge has the same vehicle name."""

    name_in_log = "zenoh.name_taken"
    level: Level = "warning"
    vehicle: str
    by: str
    what: str = RENAME


class Liveliness:
    """Shows that the bridge is alive. `others`: sessions of other bridges with the same vehicle name."""

    def __init__(self, vehicle: str, emit: Emit) -> None:
        self._vehicle = vehicle
        self._emit = emit
        self._loop = asyncio.get_running_loop()
        self._own = ""
        self._token: zenoh.LivelinessToken | None = None
        self.others: set[str] = set()
        self._neighbours: set[str] = set()

    def declare(self, session: zenoh.Session, alive: str) -> None:
        """Declare the token and find others. Called on the session's thread. `alive`: the tokens' key prefix."""
        self._own = str(session.zid())

        def joined(event: zenoh.TransportEvent) -> None:
            is_there = event.kind == zenoh.SampleKind.PUT
            post(self._loop, self._neighbours.add if is_there else self._neighbours.discard, str(event.transport.zid))

        session.info.declare_transport_events_listener(zenoh.handlers.Callback(joined, indirect=False), history=True)
        liveliness = session.liveliness()
        # Must be kept: zenoh undeclares a token that is garbage-collected.
        self._token = liveliness.declare_token(f"{alive}/{self._own}")

        def seen(sample: zenoh.Sample) -> None:
            is_there = sample.kind == zenoh.SampleKind.PUT
            post(self._loop, self._seen, str(sample.key_expr).rpartition("/")[2], is_there)

        liveliness.declare_subscriber(f"{alive}/*", zenoh.handlers.Callback(seen, indirect=False), history=True)

    def _seen(self, peer_id: str, is_there: bool) -> None:
        if peer_id == self._own or is_there == (peer_id in self.others):
            return
        if is_there:
            self.others.add(peer_id)
            self._emit(NameTaken(vehicle=self._vehicle, by=peer_id))
        else:
            self.others.discard(peer_id)

    @property
    def is_alone(self) -> bool:
        return not self._neighbours

    def status(self) -> Json:
        return {
            "zenoh": "open" if self._own else "not open",
            "zenoh_neighbours": len(self._neighbours),
            "zenoh_others_of_this_name": len(self.others),
        }
