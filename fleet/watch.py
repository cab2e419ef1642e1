# SPDX-License-Identifier: GPL-3.0-or-later
"""The fleet as it changes: the vehicles that are alive, and the newest values of each.

All send their overview, 14 B/s. Only the vehicles on the screen also send their state, 1,400 B/s. Liveliness tokens
have a session of their own: a zenoh session compares each arriving sample with every token that it knows, which takes
a whole core for a thousand samples a second with ten thousand tokens.
"""

import time
from collections import deque
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import zenoh

from fleet.payload import decode
from fleet.session import send_query
from fleet.vehicle import BridgeId, FleetVehicle, bridge_of, in_order, replier, vehicle_of
from payloads.keys import ALIVE, OVERVIEW, STATE, full, vehicle_in
from payloads.mission_data import Json
from payloads.overview import state_of

_TIMEOUT_S = 20.0
#: The list of ten thousand takes some seconds.
_LIST_TIMEOUT_S = 60.0


class Watch:
    """The fleet as heard so far. Times are `clock`'s, seconds.

    Samples are kept as they arrive and read by `look`: decoding them on zenoh's threads would cost twice as much.
    """

    def __init__(
        self,
        session: zenoh.Session,
        roll: zenoh.Session,
        prefix: str,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._session = session
        self._roll = roll
        self._prefix = prefix
        self._clock = clock
        self._arrived: deque[tuple[Callable[[Any], None], Any]] = deque()
        #: By name: the sessions of its bridges, normally one.
        self._bridges: dict[str, set[str]] = {}
        #: By name: the newest values, and when they arrived.
        self._heard: dict[str, tuple[FleetVehicle, float]] = {}
        #: The names in order, or empty after a change.
        self._names: list[str] = []
        self._followed: dict[str, zenoh.Subscriber[None]] = {}
        #: True if the router has listed all vehicles. `_is_incomplete`: the list ends early.
        self.is_listed = self._is_incomplete = False

    def later(self, take: Callable[[Any], None], *, has_end: bool = False) -> "zenoh.handlers.Callback[Any]":
        """Have the next `look` call `take` with what arrives. `has_end`: in the end with None."""

        def arrived(what: Any) -> None:
            self._arrived.append((take, what))

        return zenoh.handlers.Callback(arrived, (lambda: arrived(None)) if has_end else None, indirect=False)

    def follow(self, names: Collection[str]) -> None:
        """Subscribe to the states of these vehicles. Overviews always come from all."""
        for name in self._followed.keys() - set(names):
            self._followed.pop(name).undeclare()  # type: ignore[no-untyped-call]
        for name in set(names) - self._followed.keys():
            key = full(self._prefix, name, STATE.suffix)
            self._followed[name] = self._session.declare_subscriber(key, self.later(self.sample))

    def call_roll(self) -> None:
        """Have the router list the tokens, then query the overviews of all."""
        self.is_listed, self._is_incomplete = False, False
        take = self.later(self.listed, has_end=True)
        self._roll.liveliness().get(full(self._prefix, "*", f"{ALIVE}/*"), take, timeout=_LIST_TIMEOUT_S)

    def listed(self, reply: zenoh.Reply | None) -> None:
        """Take a token of the router's list. Returns None if the list has ended."""
        if reply is None:
            # Now, because replies count only from bridges that are known to be alive.
            self.is_listed = not self._is_incomplete
            everyone = full(self._prefix, "*", OVERVIEW.suffix)
            send_query(self._session, everyone, lambda reply: self._arrived.append((self.reply, reply)), _TIMEOUT_S)
        elif reply.ok is None:
            self._is_incomplete = True
        elif (bridge := bridge_of(str(reply.ok.key_expr), self._prefix)) is not None:
            self.appeared(bridge)

    def token(self, sample: zenoh.Sample) -> None:
        """Take a liveliness token: a bridge appeared or disappeared."""
        bridge = bridge_of(str(sample.key_expr), self._prefix)
        if bridge is None:
            return
        if sample.kind == zenoh.SampleKind.PUT:
            self.appeared(bridge)
            return
        ids = self._bridges.get(bridge.vehicle, set())
        ids.discard(bridge.session_id)
        if not ids:
            self._bridges.pop(bridge.vehicle, None)
            self._heard.pop(bridge.vehicle, None)
            self._names = []

    def appeared(self, bridge: BridgeId) -> None:
        if bridge.vehicle not in self._bridges:
            self._names = []
        self._bridges.setdefault(bridge.vehicle, set()).add(bridge.session_id)

    def sample(self, sample: zenoh.Sample) -> None:
        """Take a state that a vehicle published."""
        self._take(sample, decode(sample))

    def overview(self, sample: zenoh.Sample) -> None:
        """Take an overview that a vehicle published."""
        overview = decode(sample)
        self._take(sample, overview and state_of(overview))

    def reply(self, reply: zenoh.Reply | None) -> None:
        """Take a bridge's overview; None is the end. A storage's reply may be of a vehicle that left long ago."""
        bridge = reply and replier(reply)
        if reply is None or reply.ok is None or bridge is None:
            return
        if bridge.session_id in self._bridges.get(bridge.vehicle, ()):
            self.overview(reply.ok)

    def look(self) -> list[tuple[FleetVehicle, float | None]]:
        """The bridges that are alive, by name, and the age of their newest values, or None if not heard yet."""
        while self._arrived:
            take, arrived = self._arrived.popleft()
            take(arrived)
        now = self._clock()
        self._names = self._names or sorted(self._bridges, key=in_order)
        seen: list[tuple[FleetVehicle, float | None]] = []
        for name in self._names:
            ids, heard = self._bridges[name], self._heard.get(name)
            age_s = None if heard is None else now - heard[1]
            for session_id in ids if len(ids) == 1 else sorted(ids):
                vehicle = FleetVehicle(name, session_id) if heard is None else heard[0]
                if len(ids) > 1 or vehicle.session_id != session_id:
                    vehicle = replace(vehicle, session_id=session_id, bridges=len(ids))
                seen.append((vehicle, age_s))
        return seen

    def _take(self, sample: zenoh.Sample, state: Json | None) -> None:
        if state is None:
            return
        name = vehicle_in(sample.key_expr)
        session_id = next(iter(self._bridges.get(name, ())), "")
        self._heard[name] = vehicle_of(BridgeId(name, session_id), state), self._clock()


@contextmanager
def watching(session: zenoh.Session, roll: zenoh.Session, prefix: str) -> Iterator[Watch]:
    """Subscribe to the fleet, including the vehicles that are alive already. `roll`: the session for the tokens."""
    watch = Watch(session, roll, prefix)
    with (
        session.declare_subscriber(full(prefix, "*", OVERVIEW.suffix), watch.later(watch.overview)),
        roll.liveliness().declare_subscriber(full(prefix, "*", f"{ALIVE}/*"), watch.later(watch.token), history=True),
    ):
        watch.call_roll()
        yield watch
