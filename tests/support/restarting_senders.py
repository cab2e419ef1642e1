# SPDX-License-Identifier: GPL-3.0-or-later
"""The uploads of Mission Planner, MAVSDK and MAVProxy in simulated time, from their sources.

QGroundControl's is in tests/support/qgc_upload.py. They differ in the requests that they answer, and in their repeats.
"""

from collections.abc import Callable, Sequence
from functools import partial

from protocols.mavlink.dialect import Message
from protocols.mission_item import MissionItem, MissionResult
from tests.support.conversations import count_message, item_message
from tests.support.qgc_upload import Clock, QgcUpload
from tests.support.world import GroundStation, Radio, World


class SentList:
    """A list being uploaded. `send` puts a message on the link; `stop` ends it silently."""

    def __init__(self, clock: Clock, send: Callable[[Message], None], items: Sequence[MissionItem]) -> None:
        self._clock, self._send, self._items = clock, send, items
        self.result: MissionResult | None = None
        self.gave_up = False
        self._timer = 0
        self._begin()

    @property
    def is_over(self) -> bool:
        return self.gave_up or self.result is not None

    def stop(self) -> None:
        self.gave_up = True

    def received(self, message: Message) -> None:
        if self.is_over:
            return
        match message.get_type():
            case "MISSION_REQUEST":
                self._requested(message.seq)
            case "MISSION_ACK":
                self._acked(MissionResult(message.type))

    def _begin(self) -> None:
        self._count()

    def _count(self) -> None:
        self._send(count_message(len(self._items)))

    def _item(self, seq: int) -> None:
        self._send(item_message(seq, self._items[seq]))

    def _requested(self, seq: int) -> None:
        raise NotImplementedError

    def _acked(self, result: MissionResult) -> None:
        self.result = result

    def _wait(self, seconds: float, then: Callable[[], None]) -> None:
        """Restart the only timer."""
        self._timer += 1
        self._clock.after(seconds, partial(self._timeout, self._timer, then))

    def _timeout(self, timer: int, then: Callable[[], None]) -> None:
        if timer == self._timer and not self.is_over:
            then()


class PlannerUpload(SentList):
    """Mission Planner (setWPTotal, setWP): waits for a request for item 0 or 1, then sends one item after another.

    It never goes back: a request for another item than the next one makes it repeat its present item.
    """

    _at = -1
    _tries = 4

    def _begin(self) -> None:
        if self._tries == 0:
            self.gave_up = True
            return
        self._tries -= 1
        self._count()
        self._wait(0.7, self._begin)

    def _repeat(self) -> None:
        if self._tries == 0:
            self.gave_up = True
            return
        self._tries -= 1
        self._item(self._at)
        self._wait(0.45, self._repeat)

    def _requested(self, seq: int) -> None:
        if self._at < 0:
            if seq > 1:
                return
            self._next()
        elif seq == self._at + 1:
            self._next()
        else:
            self._repeat()

    def _acked(self, result: MissionResult) -> None:
        if self._at < 0:
            # Any ack means "continue".
            self._next()
        elif result is MissionResult.ACCEPTED and self._at < len(self._items) - 1:
            # Of another list: to Mission Planner it is the answer to its present item.
            self._next()
        else:
            self.result = result

    def _next(self) -> None:
        self._at += 1
        self._tries = 11
        if self._at == len(self._items):
            self.gave_up = True
        else:
            self._repeat()


class MavsdkUpload(SentList):
    """MAVSDK: answers the request for the next item and for earlier ones, at most five of these in a row.

    Any request ends the repeats of its MISSION_COUNT.
    """

    _sends_items = False
    _expected = _retries = 0

    def _begin(self) -> None:
        self._retries += 1
        self._count()
        self._wait(0.5, self._waited)

    def _waited(self) -> None:
        if self._retries >= 5:
            self.gave_up = True
        elif self._sends_items:
            self._retries += 1
            self._wait(0.5, self._waited)
        else:
            self._begin()

    def _requested(self, seq: int) -> None:
        self._sends_items = True
        if seq > self._expected:
            return
        if seq == self._expected:
            self._retries = 0
        elif self._retries >= 5:
            self.gave_up = True
            return
        self._retries += 1
        self._expected = seq + 1
        self._item(seq)
        self._wait(0.5, self._waited)

    def _acked(self, result: MissionResult) -> None:
        self.result = result
        if result is MissionResult.ACCEPTED and self._expected < len(self._items):
            self.gave_up = True


class MavproxyUpload(SentList):
    """MAVProxy: announces its list once, and for 10 s answers every request until it has sent the last item."""

    _done = False

    def _begin(self) -> None:
        self._count()
        self._wait(10.0, self.stop)

    def _requested(self, seq: int) -> None:
        if not self._done:
            self._item(seq)
            self._wait(10.0, self.stop)
            self._done = seq == len(self._items) - 1


class StubbornUpload(SentList):
    """A made-up sender with the habits that mix lists most easily: it answers each request, and repeats by itself."""

    _seq = -1
    _tries = 12

    def _begin(self) -> None:
        if self._tries == 0:
            self.gave_up = True
            return
        self._tries -= 1
        if self._seq < 0:
            self._count()
        else:
            self._item(self._seq)
        self._wait(0.45, self._begin)

    def _requested(self, seq: int) -> None:
        self._seq, self._tries = seq, 12
        self._begin()


class Restarter(GroundStation):
    """A ground station that begins a second list `delay_s` after it has sent the item `at` of the first.

    `at` -1: the MISSION_COUNT. The network loses the second list's first MISSION_COUNT.
    """

    def __init__(
        self,
        world: World,
        kind: type[SentList | QgcUpload],
        lists: Sequence[Sequence[MissionItem]],
        at: int,
        delay_s: float,
        radio: Radio,
    ) -> None:
        super().__init__(world, radio=radio)
        self._kind, self._lists, self._at, self._delay_s = kind, [*lists], at, delay_s
        self.stay_connected()
        self._begin()
        self.on_message.append(lambda message: self.upload.received(message))

    @property
    def is_over(self) -> bool:
        return not self._lists and self.upload.is_over

    def _begin(self) -> None:
        self.upload = self._kind(self.world, self._send_item, self._lists.pop(0))

    def _send_item(self, message: Message) -> None:
        self.send(message)
        seq = -1 if message.get_type() == "MISSION_COUNT" else message.seq
        if self._lists and seq == self._at:
            self._at = -2
            self.world.after(self._delay_s, self._again)

    def _again(self) -> None:
        self.upload.gave_up = True
        loss, self.radio.loss = self.radio.loss, 1.0
        self._begin()
        self.radio.loss = loss
