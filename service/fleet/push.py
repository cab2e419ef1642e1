# SPDX-License-Identifier: GPL-3.0-or-later
"""One mission to many vehicles at once; what happens to one is nothing to the others.

`FleetPush` is told what comes and knows how each vehicle stands; `push` lets zenoh tell it.
"""

import queue
from collections import deque
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

import zenoh

from service.fleet.payload import decode, part, text, whole
from service.fleet.session import AT_ONCE, ask, send_query
from service.fleet.vehicle import BridgeState, bridge_of, replier
from service.mission_data import Json
from service.zenoh_link.keys import ALIVE, STATE, UPLOAD, full

#: 146 records take 2 s at 115200 baud and half a minute at 9600; a bad line may double that.
_PATIENCE_S = 120.0
_STATE_PATIENCE_S = 2.0
_ACCEPTED = "MAV_MISSION_ACCEPTED"
_LOOK = "`naze-bridge fleet list` tells what it holds"
_LOST = f"it, or the router, went away before the end of the push was known; {_LOOK} when it is back"
_SILENT = "it takes no commands: they are off there (zenoh.commands), or the router's access control denies them to you"
_TWO = "several bridges use this name, and the mission is for one: give each its own name (zenoh.vehicle)"
_TOO_LATE = f"the end of the push was not known after {_PATIENCE_S:.0f} s; {_LOOK}"


@dataclass(slots=True)
class PushState:
    """How one vehicle stands. `records` of `total` are on its flight controller; `error` is why it failed."""

    vehicle: str
    records: int = 0
    total: int | None = None
    result: Json | None = None
    error: str | None = None
    is_begun: bool = False

    @property
    def is_done(self) -> bool:
        """Whether it will not change any more."""
        return self.result is not None or self.error is not None

    @property
    def has_failed(self) -> bool:
        """Whether the vehicle does not hold the mission, as far as is known."""
        return self.error is not None


@dataclass(slots=True)
class FleetPush:
    """Every vehicle's progress, by name."""

    vehicles: dict[str, PushState] = field(default_factory=dict)

    @classmethod
    def of(cls, names: Iterable[str], bridges: Iterable[BridgeState]) -> "FleetPush":
        """Make one for vehicles by name; a name that several bridges use fails at once."""
        found = [bridge.vehicle for bridge in bridges]
        return cls({name: PushState(name, error=_TWO if found.count(name) > 1 else None) for name in names})

    @property
    def waiting(self) -> list[str]:
        """The vehicles that are not done."""
        return [name for name, progress in self.vehicles.items() if not progress.is_done]

    @property
    def running(self) -> list[str]:
        """The vehicles that were begun and are not done."""
        return [name for name, progress in self.vehicles.items() if progress.is_begun and not progress.is_done]

    @property
    def failed(self) -> list[PushState]:
        """Those that do not hold the mission."""
        return [progress for progress in self.vehicles.values() if progress.has_failed]

    def stop(self, why: str) -> None:
        """Leave those alone that were not begun."""
        for progress in self.vehicles.values():
            if not progress.is_done and not progress.is_begun:
                progress.error = f"not begun: {why}"

    def replied(self, vehicle: str, reply: Json | None) -> None:
        """Take a reply: progress, or the result of a mission that was accepted."""
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
                progress.error = text(result, "text") or "it answers what this version does not understand"

    def refused(self, vehicle: str, error: Json | None) -> None:
        """Take an error; zenoh's own, that time is over, is no object."""
        progress = self.vehicles[vehicle]
        if not progress.is_done:
            progress.error = _TOO_LATE if error is None else text(error, "error") or "it refuses without a reason"

    def ended(self, vehicle: str, *, is_alive: bool) -> None:
        """No more replies will come; one that is alive and never said a word did not take the question."""
        progress = self.vehicles[vehicle]
        if not progress.is_done:
            progress.error = _SILENT if is_alive and progress.total is None else _LOST

    def gone(self, vehicle: str) -> None:
        """Its liveliness token is no more."""
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
    """Send the mission to all and wait until each is done; `show` is called whenever something has changed.

    `staged`: a tenth of the vehicles first, then the others; after a failure no other one is begun.
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
            # Its token does not tell: that of a vehicle which has just died may still be there.
            state = ask(session, full(prefix, name, STATE.suffix), timeout_s=_STATE_PATIENCE_S)
            # Neither does a storage, which goes on answering for a vehicle that has died.
            fleet.ended(name, is_alive=any(replier(reply) in bridges for reply in state))

    def start(name: str) -> None:
        fleet.vehicles[name].is_begun = True
        send_query(
            session,
            full(prefix, name, UPLOAD.suffix),
            lambda reply: events.put(lambda: taken(name, reply)),
            lambda: events.put(lambda: ended(name)),
            mission,
            _PATIENCE_S,
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
