# SPDX-License-Identifier: GPL-3.0-or-later
"""One mission to many vehicles at once, each independent of the others.

`FleetPush` keeps the progress of each vehicle. `push` feeds it from zenoh.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import zenoh

from fleet.payload import decode, part, text, whole
from fleet.session import NO_COMMANDS, NOT_UNDERSTOOD, ask_each
from payloads.keys import ZenohKey
from payloads.mission_data import ACCEPTED, Json

#: 146 records take 2 s at 115200 baud and half a minute at 9600. A bad line may double that.
_PUSH_TIMEOUT_S = 120.0
_LOOK = "`naze-bridge fleet list` shows what it holds"
_LOST = f"it or the router disconnected before the result was known; {_LOOK} when it is back"
_TOO_LATE = f"no result after {_PUSH_TIMEOUT_S:.0f} s; {_LOOK}"


@dataclass(slots=True)
class PushState:
    """The progress of one vehicle. `records` of `total` are written. `error`: why it failed, or was left out."""

    vehicle: str
    records: int = 0
    total: int | None = None
    result: Json | None = None
    error: str | None = None
    is_begun: bool = False
    is_left_out: bool = False

    @property
    def is_done(self) -> bool:
        return self.result is not None or self.error is not None


class FleetPush:
    """Every vehicle's progress, by name."""

    def __init__(self, names: Iterable[str]) -> None:
        self.vehicles = {name: PushState(name) for name in names}

    @property
    def waiting(self) -> list[str]:
        return [name for name, progress in self.vehicles.items() if not progress.is_done]

    @property
    def running(self) -> list[str]:
        """The vehicles that were started and are not done."""
        return [name for name in self.waiting if self.vehicles[name].is_begun]

    @property
    def failed(self) -> list[PushState]:
        """The vehicles that are not known to hold the mission."""
        return [each for each in self.vehicles.values() if each.error is not None and not each.is_left_out]

    @property
    def left_out(self) -> list[PushState]:
        """The vehicles that were not sent to, because another had failed."""
        return [each for each in self.vehicles.values() if each.is_left_out]

    def begin(self, names: Iterable[str], *, staged: bool) -> Iterator[str]:
        """Yield each vehicle whose push begins now. With `staged` no further one after a failure."""
        for name in names:
            if staged and (failed := self.failed):
                for other in set(self.waiting) - set(self.running):
                    self.vehicles[other].is_left_out = True
                    self.vehicles[other].error = f"{failed[0].vehicle} had failed"
            if not self.vehicles[name].is_done:
                self.vehicles[name].is_begun = True
                yield name

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
            if result.get("ack") == ACCEPTED:
                progress.result = result
            else:
                progress.error = text(result, "text") or NOT_UNDERSTOOD

    def refused(self, vehicle: str, error: Json | None) -> None:
        """Take an error reply; None: zenoh's own, a timeout."""
        progress = self.vehicles[vehicle]
        if not progress.is_done:
            progress.error = _TOO_LATE if error is None else text(error, "error") or "reason not given"

    def held(self, vehicle: str, text: str) -> None:
        """Take a vehicle that does not need a push, because it holds the mission already."""
        self.vehicles[vehicle].result = {"ack": ACCEPTED, "text": text}

    def ended(self, vehicle: str) -> None:
        """Take the end of the replies."""
        progress = self.vehicles[vehicle]
        if not progress.is_done:
            progress.error = NO_COMMANDS if progress.total is None else _LOST


def push(
    session: zenoh.Session,
    prefix: str,
    fleet: FleetPush,
    file: bytes,
    show: Callable[[FleetPush], None],
    *,
    staged: bool = False,
    key: ZenohKey,
) -> None:
    """Send the file to all and wait until each is done. `show` is called after every change.

    `staged`: one vehicle first, then each time as many as have it. After a failure, further pushes are not started.
    """
    show(fleet)
    for stage in stages(fleet.waiting) if staged else [fleet.waiting]:
        begun = fleet.begin(stage, staged=staged)
        for name, reply in ask_each(session, prefix, begun, key.suffix, _PUSH_TIMEOUT_S, file):
            if reply is None:
                fleet.ended(name)
            elif reply.ok is not None:
                fleet.replied(name, decode(reply.ok))
            elif reply.err is not None:
                fleet.refused(name, decode(reply.err))
            show(fleet)


def stages(names: list[str]) -> Iterator[list[str]]:
    """1, 1, 2, 4, 8... vehicles."""
    done = 0
    while done < len(names):
        stage = names[done : done + max(done, 1)]
        yield stage
        done += len(stage)
