# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet as it changes: the vehicles that are alive, and the newest state of each.

A state once a second costs a vehicle about 1,200 B/s, its overview 12 B/s: so all send the overview, and only the
vehicles whose details are shown also send the state.
"""

import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import zenoh

from fleet.payload import decode, number, part
from fleet.session import send_query
from fleet.vehicle import BridgeId, FleetVehicle, as_fleet, bridge_of, replier, vehicle_of
from payloads.keys import ALIVE, OVERVIEW, STATE, full, vehicle_in
from payloads.mission_data import Json
from payloads.overview import state_of

_STATE_TIMEOUT_S = 2.0
#: No queue delays samples for longer: beyond this the vehicle's clock was set.
_CLOCK_WAS_SET_S = 60.0


class Watch:
    """The fleet as heard so far: filled on zenoh's threads, read by the printing one. Times are `clock`'s, seconds."""

    def __init__(self, session: zenoh.Session, prefix: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._session = session
        self._prefix = prefix
        self._clock = clock
        self._lock = threading.Lock()
        self._bridges: set[BridgeId] = set()
        self._states: dict[str, _Heard] = {}
        self._followed: dict[str, zenoh.Subscriber[None]] = {}

    def follow(self, names: Collection[str]) -> None:
        """Subscribe to the states of these vehicles ("*": all); overviews always come from all. Not thread-safe."""
        for name in self._followed.keys() - set(names):
            self._followed.pop(name).undeclare()  # type: ignore[no-untyped-call]
        for name in set(names) - self._followed.keys():
            self._followed[name] = self._session.declare_subscriber(self._key(name, STATE.suffix), self.sample)

    def ask(self, name: str) -> None:
        """Query a vehicle's state ("*": all vehicles)."""
        send_query(self._session, self._key(name, STATE.suffix), self.reply, _STATE_TIMEOUT_S)

    def token(self, sample: zenoh.Sample) -> None:
        """Take a liveliness token: a bridge appeared or disappeared."""
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
        self._take(sample, decode(sample), None)

    def overview(self, sample: zenoh.Sample) -> None:
        """Take an overview. Missing values are kept from the last state, and queried if they may have changed."""
        name, overview = vehicle_in(sample.key_expr), decode(sample)
        if overview is None:
            return
        with self._lock:
            known = self._states[name].state if name in self._states else {}
        state = state_of(overview)
        if known and part(known, "link", "state") == part(state, "link", "state"):
            state["link"] = known.get("link")
        else:
            self.ask(name)
        self._take(sample, state, None)

    def reply(self, reply: zenoh.Reply | None) -> None:
        """Take a bridge's reply; None, the end, does nothing. A storage's may be of a vehicle that left long ago."""
        bridge = reply and replier(reply)
        if reply is not None and reply.ok is not None and bridge is not None:
            self._take(reply.ok, decode(reply.ok), bridge)

    def look(self) -> tuple[list[FleetVehicle], list[float | None]]:
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

    def _key(self, name: str, suffix: str) -> str:
        return full(self._prefix, name, suffix)

    def _take(self, sample: zenoh.Sample, state: Json | None, bridge: BridgeId | None) -> None:
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

    `offset_s`: the least difference seen between our clock and its own. Any delay beyond that was spent in queues, so
    a backlog is shown with its true age, even if the clocks differ.
    """

    state: Json
    made_at: float
    offset_s: float
    replier: BridgeId | None


@contextmanager
def watching(session: zenoh.Session, prefix: str) -> Iterator[Watch]:
    """Subscribe to the fleet, including the vehicles that are alive already."""
    watch = Watch(session, prefix)
    with (
        session.liveliness().declare_subscriber(full(prefix, "*", f"{ALIVE}/*"), watch.token, history=True),
        session.declare_subscriber(full(prefix, "*", OVERVIEW.suffix), watch.overview),
    ):
        watch.ask("*")
        yield watch
