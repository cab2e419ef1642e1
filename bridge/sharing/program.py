# SPDX-License-Identifier: GPL-3.0-or-later
"""A program on a share: the budget and its waiting requests."""

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field

from bridge.gcs.budget import Rate, TokenBucket
from protocols.msp.frame import Direction, MspFrame, MspParser, request

#: mwp asks up to 190 times a second if it is answered at once. More than this is a flood.
_LIMIT = Rate(200, 200)
#: Programs mostly wait for a reply before they ask again.
_MAX_WAITING = 16
#: The part of one read from a connection that is parsed, bytes.
_READ_SIZE = 512
#: A request waits for the line for this long. INAV Configurator repeats an unanswered request after 3 s.
_WAIT_S = 3.0


@dataclass(slots=True, eq=False)
class WaitingRequest:
    """A request that is not answered yet.

    `asked`: the frame that is sent: a low command as v1, which every flight controller speaks. `is_polled`: the bridge
    polls for the same reply. `is_change`: it changes something on the flight controller.
    """

    frame: MspFrame
    until: float
    asked: bytes = field(init=False)
    is_polled: bool = False
    is_change: bool = False

    def __post_init__(self) -> None:
        self.asked = request(self.frame.command, self.frame.payload)


@dataclass(eq=False)
class Program:
    """A connected program. `name`: its address, `host`: the part of it without the port.

    `send` carries a frame to it, `close` the connection, or None over UDP, which has none. `may_write`: it may change
    something on the flight controller.
    """

    name: str
    host: str
    send: Callable[[bytes], None]
    close: Callable[[], None] | None
    _: KW_ONLY
    may_write: bool
    waiting: list[WaitingRequest] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._parser = MspParser(takes_low_v2=True)
        self._budget = TokenBucket(_LIMIT)

    def take(self, data: bytes, now: float) -> int | None:
        """Queue the requests in `data`. The number that were parsed, None if all were dropped because of a flood."""
        if not self._budget.has(now):
            return None
        if self.close is None:
            # Complete requests only: the rest of a truncated request may be lost.
            self._parser = MspParser(takes_low_v2=True)
        requests = [frame for frame in self._parser.feed(data[-_READ_SIZE:]) if frame.direction is Direction.REQUEST]
        self._budget.spend(len(requests))
        accepted = requests[: _MAX_WAITING - len(self.waiting)]
        self.waiting += [WaitingRequest(frame, now + _WAIT_S) for frame in accepted]
        return len(requests)

    def answer(self, waiting: WaitingRequest, reply: MspFrame) -> None:
        self.waiting.remove(waiting)
        self.send(MspFrame(reply.direction, reply.command, reply.payload, waiting.frame.is_v2).encode())
