# SPDX-License-Identifier: GPL-3.0-or-later
"""Replays the flight controller of a UART capture, to reproduce field problems, or in simulated time in a test.

Unsolicited data is sent at its recorded time. Replies are sent on request, because the current bridge may send other
requests, or the same ones at other times: the reply, if any, that the same request got at this time of the recording,
with the same delay. Invented replies:

- A request that was never recorded gets MSP's error frame, as from firmware that does not know it, if the flight
  controller answered anything at that time.
- A request that was recorded only later (a mission is uploaded earlier now) gets its later replies, in order.
- After the end the last replies are repeated.
"""

import heapq
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import inf

from protocols.msp.frame import Direction, MspFrame, MspParser
from protocols.uart_capture import UartAction, UartEvent
from simulator.commands.exchanges import Exchange, match_replies

#: A speed for lines without one.
_ANY_SPEED = 115200
#: The tolerance for matching a request with a recorded one.
_JITTER_S = 0.25
#: The delay of an invented error frame.
_GUESSED_DELAY_S = 0.005


class _Exchanges:
    """The recorded exchanges of one request."""

    def __init__(self) -> None:
        self._exchanges: list[Exchange] = []
        self._times: list[float] = []
        self._ahead = -1  # the last reply given before its time

    def add(self, exchange: Exchange) -> None:
        self._exchanges.append(exchange)
        self._times.append(exchange.requested_at)

    def at(self, time: float) -> Exchange:
        """The exchange to replay for a request at this time."""
        index = bisect_right(self._times, time) - 1
        if index + 1 < len(self._times):
            early = self._times[index + 1] - time
            if early <= _JITTER_S and (index < 0 or early < time - self._times[index]):
                index += 1
        if index < max(self._ahead, 0):
            self._ahead = index = min(self._ahead + 1, len(self._exchanges) - 1)
        return self._exchanges[index]


class CapturePlayer:
    """Takes the place of SimulatedNaze on a line. `tempo`: the speed relative to the recording."""

    def __init__(self, events: Sequence[UartEvent], tempo: float = 1.0) -> None:
        self._tempo = tempo
        self._began_at: float | None = None
        self._time = 0.0
        self._parser = MspParser()
        self._going_out: list[tuple[tuple[float, int], int, bytes]] = []
        self._answers = 0
        self._last_answer = (0.0, 0)

        conversation = match_replies(events)
        self._unsolicited = conversation.unsolicited
        self._unsolicited_done = 0
        self._exchanges = conversation.exchanges
        self._request_times = [exchange.requested_at for exchange in conversation.exchanges]
        self._by_request: dict[tuple[int, bytes], _Exchanges] = {}
        for exchange in conversation.exchanges:
            self._by_request.setdefault(exchange.request, _Exchanges()).add(exchange)
        changes = [*events[:1], *(event for before, event in pairwise(events) if before.speed != event.speed)]
        self._speed_times = [event.at for event in changes]
        self._speeds = [event.speed or _ANY_SPEED for event in changes]
        self._ends_at = events[-1].at if events else 0.0
        self._outages = _outages(events)

    @property
    def baud(self) -> int:
        """The recorded port's speed at this time: the recorded bytes are exact only at the same speed."""
        index = max(bisect_right(self._speed_times, self._time) - 1, 0)
        return self._speeds[index] if self._speeds else _ANY_SPEED

    @property
    def duration_s(self) -> float:
        """The duration of the replay."""
        return self._ends_at / self._tempo

    @property
    def outages(self) -> list[tuple[float, float]]:
        """When the port was closed and opened again, in seconds from the start of the replay."""
        return [(closed / self._tempo, opened / self._tempo) for closed, opened in self._outages]

    def power_on_booted(self, now: float) -> None:
        if self._began_at is None:
            self._began_at = now

    def receive(self, data: bytes, now: float) -> None:
        time = self._set_time(now)
        for frame in self._parser.feed(data):
            if frame.direction is Direction.REQUEST and not self._is_closed(time):
                self._answer(frame, time)

    def advance(self, now: float) -> bytes:
        time = self._set_time(now)
        found: list[tuple[tuple[float, int], int, bytes]] = []
        while self._unsolicited_done < len(self._unsolicited) and self._unsolicited[self._unsolicited_done][0] <= time:
            at, offset, data = self._unsolicited[self._unsolicited_done]
            found.append(((at, offset), 0, data))
            self._unsolicited_done += 1
        while self._going_out and self._going_out[0][0][0] <= time:
            found.append(heapq.heappop(self._going_out))
        return b"".join(data for _, _, data in sorted(found))

    def next_wakeup(self, now: float) -> float:
        """The time for the next call of `advance`; infinity if nothing will happen by itself."""
        due = self._going_out[0][0][0] if self._going_out else inf
        if self._unsolicited_done < len(self._unsolicited):
            due = min(due, self._unsolicited[self._unsolicited_done][0])
        assert self._began_at is not None
        return max(now, self._began_at + due / self._tempo)

    def _set_time(self, now: float) -> float:
        """The time in the recording, to the microsecond."""
        assert self._began_at is not None
        self._time = round((now - self._began_at) * self._tempo, 6)
        return self._time

    def _answer(self, frame: MspFrame, time: float) -> None:
        recorded = self._by_request.get((frame.command, frame.payload))
        exchange = None if recorded is None else recorded.at(time)
        if exchange is None:
            if self._was_answering(time):
                self._send(MspFrame(Direction.ERROR, frame.command).encode(), time + _GUESSED_DELAY_S, 0)
        elif abs(exchange.requested_at - time) <= _JITTER_S or self._was_answering(time):
            for at, offset, piece in exchange.answer:
                self._send(piece, round(time + at - exchange.requested_at, 6), offset)

    def _was_answering(self, time: float) -> bool:
        """True if one of the last two requests before this time was answered."""
        index = bisect_right(self._request_times, time)
        return any(exchange.answer for exchange in self._exchanges[max(index - 2, 0) : index])

    def _send(self, data: bytes, at: float, offset: int) -> None:
        """Send at the given time, but never before earlier data."""
        self._last_answer = max(self._last_answer, (at, offset))
        self._answers += 1
        heapq.heappush(self._going_out, (self._last_answer, self._answers, data))

    def _is_closed(self, time: float) -> bool:
        return any(closed <= time < opened for closed, opened in self._outages)


def _outages(events: Sequence[UartEvent]) -> list[tuple[float, float]]:
    found: list[tuple[float, float]] = []
    closed_at: float | None = None
    for event in events:
        if event.action is UartAction.CLOSE:
            closed_at = event.at
        elif closed_at is not None:
            found.append((closed_at, event.at))
            closed_at = None
    return found
