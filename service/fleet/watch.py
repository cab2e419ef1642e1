# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet as it changes: who is alive, and everybody's newest state."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import zenoh

from service.fleet.payload import decode
from service.fleet.session import send_query
from service.fleet.vehicle import BridgeState, Vehicle, as_fleet, bridge_of, vehicle_of
from service.mission_data import Json
from service.zenoh_link.keys import ALIVE, STATE, full

_PATIENCE_S = 2.0


class Watch:
    """What was heard; zenoh's threads fill it, the one that prints looks at it. Times are `clock`'s, seconds."""

    def __init__(self, prefix: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._prefix = prefix
        self._clock = clock
        self._lock = threading.Lock()
        self._bridges: set[BridgeState] = set()
        self._states: dict[str, tuple[Json, float]] = {}

    def token(self, sample: zenoh.Sample) -> None:
        """Take note that somebody came or went."""
        bridge = bridge_of(str(sample.key_expr), self._prefix)
        if bridge is None:
            return
        with self._lock:
            if sample.kind == zenoh.SampleKind.PUT:
                self._bridges.add(bridge)
            else:
                self._bridges.discard(bridge)

    def sample(self, sample: zenoh.Sample) -> None:
        """Take a state."""
        state = decode(sample)
        if state is not None:
            with self._lock:
                self._states[str(sample.key_expr).split("/")[1]] = (state, self._clock())

    def look(self) -> tuple[list[Vehicle], list[float | None]]:
        """Return who is alive, by name, and how long ago each was heard."""
        with self._lock:
            now = self._clock()
            told = {bridge: self._states.get(bridge.vehicle) for bridge in self._bridges}
        fleet = as_fleet(vehicle_of(bridge, entry[0] if entry else None) for bridge, entry in told.items())
        heard = {bridge.vehicle: entry[1] for bridge, entry in told.items() if entry}
        return fleet, [now - heard[vehicle.name] if vehicle.name in heard else None for vehicle in fleet]

    def reply(self, reply: zenoh.Reply) -> None:
        """Take the state of somebody who was asked for it."""
        if reply.ok is not None:
            self.sample(reply.ok)


@contextmanager
def watching(session: zenoh.Session, prefix: str) -> Iterator[Watch]:
    """Hear the fleet: those who are there already at once, and then what changes."""
    watch = Watch(prefix)
    states = full(prefix, "*", STATE.suffix)
    with (
        session.liveliness().declare_subscriber(full(prefix, "*", f"{ALIVE}/*"), watch.token, history=True),
        session.declare_subscriber(states, watch.sample),
    ):
        send_query(session, states, watch.reply, lambda: None, None, _PATIENCE_S)
        yield watch
