# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet as it changes: who is alive, and everybody's newest state."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import zenoh

from service.fleet.payload import decode, number
from service.fleet.session import send_query
from service.fleet.vehicle import BridgeState, Vehicle, as_fleet, bridge_of, replier, vehicle_of
from service.mission_data import Json
from service.zenoh_link.keys import ALIVE, STATE, full, vehicle_in

_PATIENCE_S = 2.0
#: No queue holds samples for longer: then the vehicle's clock was set.
_CLOCK_WAS_SET_S = 60.0


class Watch:
    """What was heard; zenoh's threads fill it, the one that prints looks at it. Times are `clock`'s, seconds."""

    def __init__(self, prefix: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._prefix = prefix
        self._clock = clock
        self._lock = threading.Lock()
        self._bridges: set[BridgeState] = set()
        self._states: dict[str, _Heard] = {}

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
        """Take a state that a vehicle published."""
        self._take(sample, None)

    def reply(self, reply: zenoh.Reply) -> None:
        """Take the state that a bridge replied with. A storage's may be of a vehicle that is long gone."""
        bridge = replier(reply)
        if reply.ok is not None and bridge is not None:
            self._take(reply.ok, bridge)

    def look(self) -> tuple[list[Vehicle], list[float | None]]:
        """The vehicles that are alive, by name, and the age of each one's newest state."""
        with self._lock:
            now = self._clock()
            bridges = set(self._bridges)
            states = {
                name: heard for name, heard in self._states.items() if heard.replier is None or heard.replier in bridges
            }
        fleet = as_fleet(
            vehicle_of(bridge, states[bridge.vehicle].state if bridge.vehicle in states else None) for bridge in bridges
        )
        ages_s = [now - states[each.name].made_at if each.name in states else None for each in fleet]
        return fleet, ages_s

    def _take(self, sample: zenoh.Sample, bridge: BridgeState | None) -> None:
        state = decode(sample)
        if state is None:
            return
        with self._lock:
            now = self._clock()
            name = vehicle_in(sample.key_expr)
            made_s = number(state, "time_s")
            offset_s = now - (now if made_s is None else made_s)
            before = self._states.get(name)
            least_s = offset_s if before is None else min(offset_s, before.offset_s)
            if offset_s - least_s > _CLOCK_WAS_SET_S:
                least_s = offset_s
            self._states[name] = _Heard(state, now - (offset_s - least_s), least_s, bridge)


@dataclass(frozen=True, slots=True)
class _Heard:
    """`made_at`: when the vehicle made the state, by our clock.

    `offset_s`: the least difference seen between our clock and its own. What a sample took beyond that, it spent in
    queues: a backlog is shown as old as it is, whatever the clocks say.
    """

    state: Json
    made_at: float
    offset_s: float
    replier: BridgeState | None


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
