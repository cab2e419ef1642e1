# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl's transfers over a lossy link, with the bridge or with an ideal vehicle.

Source: PlanManager.cc (commit c15cc3204 of February 2026): _ackTimeout, _startAckTimeout, _handleMissionCount,
_handleMissionItem, _handleMissionRequest, _handleMissionAck. Its heartbeat: MultiVehicleManager::_sendGCSHeartbeat.

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

_TIMEOUT_S, _ITEM_TIMEOUT_S = 1.5, 0.25
#: A count or a list request is sent seven times: five retries are exceeded with the next one.
_RETRIES = 6
_OF_A_MISSION = frozenset(
    (
        messages.MAVLINK_MSG_ID_MISSION_REQUEST,
        messages.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        messages.MAVLINK_MSG_ID_MISSION_ACK,
        messages.MAVLINK_MSG_ID_MISSION_COUNT,
        messages.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        messages.MAVLINK_MSG_ID_STATUSTEXT,
    )
)


QGC_HEARTBEAT = messages.MAVLink_heartbeat_message(6, 8, 192, 0, 4, 3)


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
        #: It was ended by an ack that cannot be its own: "Mission transfer failed. Error: Mission accepted".
        self.took_foreign_ack = False
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
            case "MISSION_REQUEST" | "MISSION_REQUEST_INT":
                self._requested.add(message.seq)
                self._send(item_message(message.seq, self._items[message.seq], mission_type=self._mission_type))
                self._wait()
            case "MISSION_ACK" if message.type != MissionResult.INVALID_SEQUENCE:
                self.result = MissionResult(message.type)
                # An early "accepted" is an error, too.
                self.took_foreign_ack = self.result is MissionResult.ACCEPTED and len(self._requested) < len(
                    self._items
                )
                self.gave_up |= self.took_foreign_ack

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


class QgcDownload:
    """Requests the list every 1.5 s and each item every 0.25 s, six times more. Any MISSION_ACK ends it as an error.

    It takes any item that is missing, and waits again after one that it has.
    """

    def __init__(self, clock: Clock, send: Callable[[Message], None]) -> None:
        self._clock, self._send = clock, send
        self.items: dict[int, Message] = {}
        self.is_over = self.gave_up = self.took_foreign_ack = False
        self._count: int | None = None
        self._retries = self._timer = 0
        self._ask()

    def received(self, message: Message) -> None:
        if self.is_over:
            return
        match message.get_type():
            case "MISSION_COUNT" if self._count is None:
                self._count = message.count
                self._go_on()
            case "MISSION_ITEM_INT" if self._count is not None and message.seq not in self.items:
                self.items[message.seq] = message
                self._go_on()
            case "MISSION_ITEM_INT" if self._count is not None:
                self._wait()
            case "MISSION_ACK" if message.type != MissionResult.INVALID_SEQUENCE:
                self.took_foreign_ack = message.type == MissionResult.ACCEPTED
                self.is_over = self.gave_up = True

    def _go_on(self) -> None:
        self._retries = 0
        if len(self.items) == self._count:
            self.is_over = True
            self._send(messages.MAVLink_mission_ack_message(1, 1, MissionResult.ACCEPTED))
        else:
            self._ask()

    def _ask(self) -> None:
        if self._count is None:
            self._send(messages.MAVLink_mission_request_list_message(1, 1))
        else:
            wanted = next(seq for seq in range(self._count) if seq not in self.items)
            self._send(messages.MAVLink_mission_request_int_message(1, 1, wanted))
        self._wait()

    def _wait(self) -> None:
        self._timer += 1
        seconds = _TIMEOUT_S if self._count is None else _ITEM_TIMEOUT_S
        self._clock.after(seconds, partial(self._timeout, self._timer))

    def _timeout(self, timer: int) -> None:
        if self.is_over or timer != self._timer:
            return
        self._retries += 1
        if self._retries > _RETRIES:
            self.is_over = self.gave_up = True
        else:
            self._ask()


Transfer = QgcUpload | QgcDownload


class QgcStation(GroundStation):
    """QGroundControl's end of a fated link to the bridge."""

    def __init__(self, world: World, link: FatedLink, name: str) -> None:
        super().__init__(world, name)
        self._link = link
        self.upload: Transfer | None = None
        world.receive_from(self, self.pack(QGC_HEARTBEAT))

    def send(self, message: Message, *, wait_s: float = 0.0) -> None:
        data = self.pack(message)
        self._link.carry(_name(message), lambda: self.world.receive_from(self, data))
        self.world.run(wait_s)

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

    Repeats its final ack after 0.4 and 0.9 s, unless the station has it.
    """

    def __init__(self, clock: Clock, send: Callable[[Message], None], station_waits: Callable[[], bool]) -> None:
        self._clock, self._send, self._station_waits = clock, send, station_waits
        self.items: dict[int, Message] = {}
        self._count = self._wanted = 0

    def expect_next(self) -> None:
        """The station begins another transfer."""
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
                        self._clock.after(later_s, self._accept)
            case "MISSION_REQUEST_LIST":
                self._send(messages.MAVLink_mission_count_message(255, 190, len(self.items)))
            case "MISSION_REQUEST_INT":
                self._send(self.items[message.seq])

    def _accept(self) -> None:
        if self._station_waits():
            self._send(messages.MAVLink_mission_ack_message(255, 190, MissionResult.ACCEPTED))

    def _request(self, seq: int) -> None:
        if seq == self._wanted and self._clock.now < 600:
            self._send(messages.MAVLink_mission_request_message(255, 190, seq))
            self._clock.after(0.25, partial(self._request, seq))


#: Begins a transfer of a station with this clock and link.
Begin = Callable[[Clock, Callable[[Message], None]], Transfer]


def with_ideal_vehicle(seed: int, loss: float, first: Begin, *later: tuple[float, Begin]) -> list[bool]:
    """Which transfers succeed; each of `later` begins so many seconds after the end of the one before."""
    clock = Timeline()
    link = FatedLink(clock, seed, loss)
    ends: list[Transfer] = []

    def down(message: Message) -> None:
        link.carry(_name(message), lambda: ends[-1].received(message))

    def up(message: Message) -> None:
        link.carry(_name(message), lambda: vehicle.received(message))

    vehicle = IdealVehicle(clock, down, lambda: not ends[-1].is_over)
    for pause_s, begin in ((0.0, first), *later):
        clock.after(pause_s, lambda begin=begin: ends.append(begin(clock, up)))  # type: ignore[misc]
        vehicle.expect_next()
        clock.run(lambda: False)
    return [not end.gave_up for end in ends]


def _name(message: Message) -> str:
    return f"{message.get_type()} {getattr(message, 'seq', '')}"
