# SPDX-License-Identifier: GPL-3.0-or-later
"""One mission to many vehicles at once, each independent of the others.

`FleetPush` keeps the progress of each vehicle; `push` feeds it from zenoh.
"""

import queue
from collections import deque
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

import zenoh

from service.cli.fleet.payload import decode, part, text, whole
from service.cli.fleet.session import AT_ONCE, NO_COMMANDS, ask, send_query
from service.cli.fleet.vehicle import BridgeState, bridge_of, replier
from service.daemon.mission_data import Json
from service.zenoh_link.keys import ALIVE, STATE, UPLOAD, full

#: 146 records take 2 s at 115200 baud and half a minute at 9600; a bad line may double that.
_PUSH_TIMEOUT_S = 120.0
_STATE_TIMEOUT_S = 2.0
_ACCEPTED = "MAV_MISSION_ACCEPTED"
_LOOK = "`naze-bridge fleet list` shows what it holds"
_LOST = f"it or the router disconnected before the result was known; {_LOOK} when it is back"
_TWO = "several bridges use this name, and the mission is for one: give each its own name (zenoh.vehicle)"
_TOO_LATE = f"no result after {_PUSH_TIMEOUT_S:.0f} s; {_LOOK}"


@dataclass(slots=True)
class PushState:
    """The progress of one vehicle. `records` of `total` are written; `error` is the reason for a failure."""

    vehicle: str
    records: int = 0
    total: int | None = None
    result: Json | None = None
    error: str | None = None
    is_begun: bool = False

    @property
    def is_done(self) -> bool:
        """True if this is final."""
        return self.result is not None or self.error is not None

    @property
    def has_failed(self) -> bool:
        """True if the vehicle is not known to hold the mission."""
        return self.error is not None


@dataclass(slots=True)
class FleetPush:
    """Every vehicle's progress, by name."""

    vehicles: dict[str, PushState] = field(default_factory=dict)

    @classmethod
    def of(cls, names: Iterable[str], bridges: Iterable[BridgeState]) -> "FleetPush":
        """Make one for vehicles by name; a name used by several bridges fails at once."""
        found = [bridge.vehicle for bridge in bridges]
        return cls({name: PushState(name, error=_TWO if found.count(name) > 1 else None) for name in names})

    @property
    def waiting(self) -> list[str]:
        """The vehicles that are not done."""
        return [name for name, progress in self.vehicles.items() if not progress.is_done]

    @property
    def running(self) -> list[str]:
        """The vehicles that were started and are not done."""
        return [name for name, progress in self.vehicles.items() if progress.is_begun and not progress.is_done]

    @property
    def failed(self) -> list[PushState]:
        """The vehicles that do not hold the mission."""
        return [progress for progress in self.vehicles.values() if progress.has_failed]

    def stop(self, why: str) -> None:
        """Skip the vehicles that were not started."""
        for progress in self.vehicles.values():
            if not progress.is_done and not progress.is_begun:
                progress.error = f"not started: {why}"

    def replied(self, vehicle: str, reply: Json | None) -> None:
        """Take a reply: progress, or the result of an accepted mission."""
        progress = self.vehicles[vehicle]
        if progress.is_done or reply is None:
            return
        records, total = whole(reply, "progress"), whole(reply, "of")
        if records is not None:
            progress.records, progress.total = records, total
        result = part(reply, "result")
        if isinstance(result, dict):
            if result.get("ack") == _ACCEPTED:
                progress.result = result
            else:
                progress.error = text(result, "text") or "this version does not understand its reply"

    def refused(self, vehicle: str, error: Json | None) -> None:
        """Take an error reply; None stands for zenoh's own, a timeout."""
        progress = self.vehicles[vehicle]
        if not progress.is_done:
            progress.error = _TOO_LATE if error is None else text(error, "error") or "it gives no reason"

    def ended(self, vehicle: str, *, is_alive: bool) -> None:
        """Take the end of the replies; `is_alive` without any reply means that the command is switched off."""
        progress = self.vehicles[vehicle]
        if not progress.is_done:
            progress.error = NO_COMMANDS if is_alive and progress.total is None else _LOST

    def gone(self, vehicle: str) -> None:
        """Take the loss of a vehicle's liveliness token."""
        progress = self.vehicles.get(vehicle)
        if progress is not None and not progress.is_done:
            progress.error = _LOST


def push(
    session: zenoh.Session,
    prefix: str,
    fleet: FleetPush,
    bridges: Collection[BridgeState],
    mission: bytes,
    show: Callable[[FleetPush], None],
    *,
    staged: bool = False,
) -> None:
    """Send the mission to all and wait until each is done; `show` is called after every change.

    `staged`: a tenth of the vehicles first, then the others; after a failure no other one is started.
    """
    events: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def taken(name: str, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            fleet.replied(name, decode(reply.ok))
        elif reply.err is not None:
            fleet.refused(name, decode(reply.err))

    def token(sample: zenoh.Sample) -> None:
        bridge = bridge_of(str(sample.key_expr), prefix)
        if bridge is not None and sample.kind == zenoh.SampleKind.DELETE:
            events.put(lambda: fleet.gone(bridge.vehicle))

    def ended(name: str) -> None:
        if not fleet.vehicles[name].is_done:
            # The token proves nothing: a vehicle that has just died may still have one.
            state = ask(session, full(prefix, name, STATE.suffix), timeout_s=_STATE_TIMEOUT_S)
            # Nor does a reply from a storage, which keeps answering for a dead vehicle.
            fleet.ended(name, is_alive=any(replier(reply) in bridges for reply in state))

    def start(name: str) -> None:
        fleet.vehicles[name].is_begun = True
        send_query(
            session,
            full(prefix, name, UPLOAD.suffix),
            lambda reply: events.put(lambda: taken(name, reply)),
            lambda: events.put(lambda: ended(name)),
            mission,
            _PUSH_TIMEOUT_S,
        )

    with session.liveliness().declare_subscriber(full(prefix, "*", f"{ALIVE}/*"), token):
        show(fleet)
        for stage in _stages(fleet.waiting, staged=staged):
            waiting = deque(stage)
            while any(not fleet.vehicles[name].is_done for name in stage):
                if staged and (failed := fleet.failed):
                    fleet.stop(f"{failed[0].vehicle} had failed")
                    waiting.clear()
                while waiting and len(fleet.running) < AT_ONCE:
                    start(waiting.popleft())
                if fleet.running:
                    events.get()()
                show(fleet)


def _stages(names: list[str], *, staged: bool) -> list[list[str]]:
    first = max(1, len(names) // 10) if staged else 0
    return [names[:first], names[first:]]
