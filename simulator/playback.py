# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays the flight controller of a UART capture: a user's field problem on a desk, or in simulated time in a test.

What it sent of its own accord comes at its time. What it answered comes when it is asked: the bridge that listens now
may ask earlier, later, or something else than the one that was recorded. So each request gets the answer that the
same request got at this time of the recording, as fast as then, and none if it got none. What is made up:

- A request that was never sent gets MSP's error frame, as from firmware that does not know it, if the flight
  controller answered at that time at all.
- A request that was sent only later (a mission is uploaded earlier now) gets the answers that it got then, in order.
- After the end the last answers are given for ever.
"""

import heapq
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import inf

from protocols.msp.frame import Direction, MspFrame, MspParser
from protocols.uart_capture import UartDeed, UartEvent
from simulator.exchanges import Exchange, take_apart

#: The speed of a line that has none.
_ANY_SPEED = 115200
#: What is asked so much earlier or later than in the recording is the same request.
_JITTER_S = 0.25
#: After how long the error frame comes that nobody recorded.
_GUESSED_DELAY_S = 0.005


class _Story:
    """What became of one question, each time that it was asked."""

    def __init__(self) -> None:
        self._exchanges: list[Exchange] = []
        self._times: list[float] = []
        self._ahead = -1  # the last answer that was given before its time

    def add(self, exchange: Exchange) -> None:
        """Add what became of it the next time."""
        self._exchanges.append(exchange)
        self._times.append(exchange.asked_at)

    def at(self, time: float) -> Exchange:
        """Return what becomes of it if it is asked now."""
        index = bisect_right(self._times, time) - 1
        if index + 1 < len(self._times):
            early = self._times[index + 1] - time
            if early <= _JITTER_S and (index < 0 or early < time - self._times[index]):
                index += 1
        if index < max(self._ahead, 0):
            self._ahead = index = min(self._ahead + 1, len(self._exchanges) - 1)
        return self._exchanges[index]


class CapturePlayer:
    """Stands in for SimulatedNaze on a line. `tempo`: how many times faster than it was recorded."""

    def __init__(self, events: Sequence[UartEvent], tempo: float = 1.0) -> None:
        self._tempo = tempo
        self._began_at: float | None = None
        self._time = 0.0
        self._parser = MspParser()
        self._going_out: list[tuple[tuple[float, int], int, bytes]] = []
        self._answers = 0
        self._last_answer = (0.0, 0)

        conversation = take_apart(events)
        self._unasked = conversation.unasked
        self._unasked_done = 0
        self._exchanges = conversation.exchanges
        self._asked_times = [exchange.asked_at for exchange in conversation.exchanges]
        self._stories: dict[tuple[int, bytes], _Story] = {}
        for exchange in conversation.exchanges:
            self._stories.setdefault(exchange.question, _Story()).add(exchange)
        changes = [*events[:1], *(event for before, event in pairwise(events) if before.speed != event.speed)]
        self._speed_times = [event.at for event in changes]
        self._speeds = [event.speed or _ANY_SPEED for event in changes]
        self._ends_at = events[-1].at if events else 0.0
        self._outages = _outages(events)

    @property
    def baud(self) -> int:
        """The speed that the recorded port had at this time: what it read is exact only at the same speed."""
        index = max(bisect_right(self._speed_times, self._time) - 1, 0)
        return self._speeds[index] if self._speeds else _ANY_SPEED

    @property
    def duration_s(self) -> float:
        """How long it plays."""
        return self._ends_at / self._tempo

    @property
    def outages(self) -> list[tuple[float, float]]:
        """When the port was closed and opened again, in seconds from the beginning of the play."""
        return [(closed / self._tempo, opened / self._tempo) for closed, opened in self._outages]

    def power_on_booted(self, now: float) -> None:
        """Begin to play."""
        if self._began_at is None:
            self._began_at = now

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes from the line."""
        time = self._set_time(now)
        for frame in self._parser.feed(data):
            if frame.direction is Direction.REQUEST and not self._is_closed(time):
                self._answer(frame, time)

    def advance(self, now: float) -> bytes:
        """Return the bytes that have come until `now` and were not returned before."""
        time = self._set_time(now)
        found: list[tuple[tuple[float, int], int, bytes]] = []
        while self._unasked_done < len(self._unasked) and self._unasked[self._unasked_done][0] <= time:
            at, offset, data = self._unasked[self._unasked_done]
            found.append(((at, offset), 0, data))
            self._unasked_done += 1
        while self._going_out and self._going_out[0][0][0] <= time:
            found.append(heapq.heappop(self._going_out))
        return b"".join(data for _, _, data in sorted(found))

    def next_wakeup(self, now: float) -> float:
        """Tell when it is next worth calling `advance`; infinity if nothing will come by itself."""
        due = self._going_out[0][0][0] if self._going_out else inf
        if self._unasked_done < len(self._unasked):
            due = min(due, self._unasked[self._unasked_done][0])
        assert self._began_at is not None
        return max(now, self._began_at + due / self._tempo)

    def _set_time(self, now: float) -> float:
        """Return the time in the recording, to the microsecond as there."""
        assert self._began_at is not None
        self._time = round((now - self._began_at) * self._tempo, 6)
        return self._time

    def _answer(self, frame: MspFrame, time: float) -> None:
        story = self._stories.get((frame.command, frame.payload))
        exchange = None if story is None else story.at(time)
        if exchange is None:
            if self._was_answering(time):
                self._send(MspFrame(Direction.ERROR, frame.command).encode(), time + _GUESSED_DELAY_S, 0)
        elif abs(exchange.asked_at - time) <= _JITTER_S or self._was_answering(time):
            for at, offset, piece in exchange.answer:
                self._send(piece, round(time + at - exchange.asked_at, 6), offset)

    def _was_answering(self, time: float) -> bool:
        """Tell whether one of the last two requests before was answered."""
        index = bisect_right(self._asked_times, time)
        return any(exchange.answer for exchange in self._exchanges[max(index - 2, 0) : index])

    def _send(self, data: bytes, at: float, offset: int) -> None:
        """Send when it is due, but never before what was sent earlier."""
        self._last_answer = max(self._last_answer, (at, offset))
        self._answers += 1
        heapq.heappush(self._going_out, (self._last_answer, self._answers, data))

    def _is_closed(self, time: float) -> bool:
        return any(closed <= time < opened for closed, opened in self._outages)


def _outages(events: Sequence[UartEvent]) -> list[tuple[float, float]]:
    found: list[tuple[float, float]] = []
    closed_at: float | None = None
    for event in events:
        if event.deed is UartDeed.CLOSE:
            closed_at = event.at
        elif closed_at is not None:
            found.append((closed_at, event.at))
            closed_at = None
    return found
