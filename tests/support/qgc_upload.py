# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl's upload (PlanManager.cc of v5.0) over a lossy link, to the bridge or to an ideal vehicle.

The link decides by seed, message and copy: the third request for item 7 has the same fate whichever vehicle sends it.
So each upload to the bridge can be compared with the same upload to the ideal vehicle.
"""

import heapq
import itertools
import random
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mission_item import MissionItem, MissionResult
from tests.support.conversations import count_message, item_message
from tests.support.world import GroundStation, World

_TIMEOUT_S = 1.5
_RETRIES = 5
_OF_A_MISSION = frozenset(
    (
        messages.MAVLINK_MSG_ID_MISSION_REQUEST,
        messages.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        messages.MAVLINK_MSG_ID_MISSION_ACK,
        messages.MAVLINK_MSG_ID_STATUSTEXT,
    )
)


class Clock(Protocol):
    """Simulated time: a World, or a Timeline."""

    now: float

    def after(self, seconds: float, what: Callable[[], None]) -> None: ...


class Timeline:
    """Simulated time without a bridge."""

    def __init__(self) -> None:
        self.now = 0.0
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = itertools.count()

    def after(self, seconds: float, what: Callable[[], None]) -> None:
        heapq.heappush(self._events, (self.now + seconds, next(self._numbers), what))

    def run(self, is_over: Callable[[], bool]) -> None:
        while self._events and not is_over():
            self.now, _, what = heapq.heappop(self._events)
            what()


@dataclass(slots=True)
class FatedLink:
    """`loss`, `repeat`: the probabilities that a message is lost or arrives twice, after `delay_s` and some jitter."""

    clock: Clock
    seed: int
    loss: float
    repeat: float = 0.03
    delay_s: float = 0.02
    jitter_s: float = 0.08
    _copies: Counter[str] = field(default_factory=Counter, init=False)

    def carry(self, message: str, arrive: Callable[[], None]) -> None:
        self._copies[message] += 1
        fate = random.Random(f"{self.seed} {message} {self._copies[message]}")
        for _ in range(1 + (fate.random() < self.repeat)):
            if fate.random() >= self.loss:
                self.clock.after(self.delay_s + self.jitter_s * fate.random(), arrive)


class QgcUpload:
    """Each request restarts its timer of 1.5 s; it announces the list again only until item 0 is requested.

    The final MISSION_ACK is never asked for again. Messages of another mission type are ignored. `send` puts a
    message on the link.
    """

    def __init__(
        self, clock: Clock, send: Callable[[Message], None], items: Sequence[MissionItem], mission_type: int = 0
    ) -> None:
        self._clock, self._send, self._items, self._mission_type = clock, send, items, mission_type
        self.result: MissionResult | None = None
        self.gave_up = False
        self._requested: set[int] = set()
        self._retries = self._timer = 0
        self._announce()

    @property
    def is_over(self) -> bool:
        return self.gave_up or self.result is not None

    def received(self, message: Message) -> None:
        if self.is_over or getattr(message, "mission_type", self._mission_type) != self._mission_type:
            return
        match message.get_type():
            case "MISSION_REQUEST":
                self._requested.add(message.seq)
                self._send(item_message(message.seq, self._items[message.seq], mission_type=self._mission_type))
                self._wait()
            case "MISSION_ACK" if message.type != MissionResult.INVALID_SEQUENCE:
                self.result = MissionResult(message.type)
                # An early "accepted" is an error, too.
                self.gave_up = self.result is MissionResult.ACCEPTED and len(self._requested) < len(self._items)

    def _announce(self) -> None:
        self._send(count_message(len(self._items), self._mission_type))
        self._wait()

    def _wait(self) -> None:
        self._timer += 1
        self._clock.after(_TIMEOUT_S, partial(self._timeout, self._timer))

    def _timeout(self, timer: int) -> None:
        if self.is_over or timer != self._timer:
            return
        if 0 in self._requested or self._retries == _RETRIES:
            self.gave_up = True
        else:
            self._retries += 1
            self._announce()


class QgcStation(GroundStation):
    """QGroundControl's end of a fated link to the bridge."""

    def __init__(self, world: World, link: FatedLink, name: str) -> None:
        super().__init__(world, name)
        self._link = link
        self.upload: QgcUpload | None = None

    def send(self, message: Message) -> None:
        data = self.pack(message)
        self._link.carry(_name(message), lambda: self.world.receive_from(self, data))

    def carry(self, frame: bytes) -> None:
        found = [each for each in MavlinkSplitter().feed(frame) if each.msgid in _OF_A_MISSION]
        together = [self._decoder.decode(bytearray(each.raw)) for each in found]
        if together:
            self._link.carry(" ".join(map(_name, together)), lambda: self._arrive(together))

    def _arrive(self, together: Sequence[Message]) -> None:
        for message in together:
            self.received.append((self.world.now, message))
            if self.upload is not None:
                self.upload.received(message)


class IdealVehicle:
    """Requests each item every 0.25 s until it is here, and has stored the list with the last one.

    Repeats its final ack after 0.4 and 0.9 s.
    """

    def __init__(self, clock: Clock, send: Callable[[Message], None]) -> None:
        self._clock, self._send = clock, send
        self.items: dict[int, Message] = {}
        self._count = self._wanted = 0

    def received(self, message: Message) -> None:
        match message.get_type():
            case "MISSION_COUNT" if not self._count:
                self._count = message.count
                self._request(0)
            case "MISSION_ITEM_INT" if message.seq == self._wanted < self._count:
                self.items[message.seq] = message
                self._wanted += 1
                if self._wanted < self._count:
                    self._request(self._wanted)
                else:
                    for later_s in (0.0, 0.4, 0.9):
                        ack = messages.MAVLink_mission_ack_message(255, 190, MissionResult.ACCEPTED)
                        self._clock.after(later_s, partial(self._send, ack))

    def _request(self, seq: int) -> None:
        if seq == self._wanted and self._clock.now < 600:
            self._send(messages.MAVLink_mission_request_message(255, 190, seq))
            self._clock.after(0.25, partial(self._request, seq))


def upload_to_ideal_vehicle(items: Sequence[MissionItem], seed: int, loss: float) -> bool:
    """True if it succeeds."""
    clock = Timeline()
    link = FatedLink(clock, seed, loss)
    ends: list[QgcUpload] = []

    def down(message: Message) -> None:
        link.carry(_name(message), lambda: ends[0].received(message))

    vehicle = IdealVehicle(clock, down)
    ends.append(QgcUpload(clock, lambda msg: link.carry(_name(msg), lambda: vehicle.received(msg)), items))
    clock.run(lambda: ends[0].is_over)
    return not ends[0].gave_up


def _name(message: Message) -> str:
    return f"{message.get_type()} {getattr(message, 'seq', '')}"
