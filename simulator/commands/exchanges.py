# SPDX-License-Identifier: GPL-3.0-or-later
"""Matches replies with requests in a UART capture and separates unsolicited data."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate

from protocols.msp.frame import Direction, MspFrame, MspParser
from protocols.uart_capture import UartAction, UartEvent

#: The reply deadline: a flight controller is faster even while it writes its flash.
_LONGEST_WAIT_S = 5.0
#: A request this shortly before the port was closed, or the recording ended, might have been answered.
_CUT_SHORT_S = 0.5

#: Command and payload of a request.
Request = tuple[int, bytes]
#: The read time, the offset in all read bytes, and the bytes.
Piece = tuple[float, int, bytes]


@dataclass(slots=True, eq=False)
class Exchange:
    """A request, and its reply in pieces as read; no pieces if there was no reply."""

    request: Request
    requested_at: float
    answer: Sequence[Piece] = ()


@dataclass(frozen=True, slots=True)
class Conversation:
    """A parsed capture. `exchanges` in the order of the requests; `unsolicited`: all other received data."""

    exchanges: Sequence[Exchange]
    unsolicited: Sequence[Piece]


def match_replies(events: Sequence[UartEvent]) -> Conversation:
    """Match replies with earlier requests by command, in order.

    Requests that the end of the recording or of the link cut short are omitted.
    """
    exchanges: list[Exchange] = []
    unsolicited: list[Piece] = []
    waiting: list[Exchange] = []
    unknown: set[Exchange] = set()
    known: dict[Request, Request] = {}  # each is kept once: few distinct ones, repeated a hundred thousand times
    answers = _answers(events, unsolicited)
    answered_by, frame, pieces = next(answers, _NO_MORE)
    requests = MspParser()
    for number, event in enumerate(events):
        if event.action in (UartAction.OPEN, UartAction.CLOSE):
            requests = MspParser()
            unknown |= _cut_short(waiting, event.at)
            waiting = []
        elif event.action is UartAction.WRITE:
            asked = []
            for found in requests.feed(event.data):
                if found.direction is Direction.REQUEST:
                    request = found.command, found.payload
                    asked.append(Exchange(known.setdefault(request, request), event.at))
            exchanges += asked
            # A repeated request replaces the earlier one, which timed out.
            repeated = {exchange.request for exchange in asked}
            waiting = [earlier for earlier in waiting if earlier.request not in repeated] + asked
        while answered_by == number:
            exchange = _exchange_of(waiting, frame, event.at)
            if exchange is None:
                unsolicited += pieces
            else:
                exchange.answer = pieces
                # Requests are answered in their order.
                del waiting[: waiting.index(exchange) + 1]
            answered_by, frame, pieces = next(answers, _NO_MORE)
    unknown |= _cut_short(waiting, events[-1].at if events else 0.0)
    return Conversation([exchange for exchange in exchanges if exchange not in unknown], sorted(unsolicited))


def _cut_short(waiting: Sequence[Exchange], at: float) -> set[Exchange]:
    return {exchange for exchange in waiting if exchange.requested_at > at - _CUT_SHORT_S}


_Answer = tuple[int, MspFrame, Sequence[Piece]]
_NO_MORE: _Answer = (-1, MspFrame(Direction.ERROR, 0), ())


def _exchange_of(waiting: Sequence[Exchange], frame: MspFrame, at: float) -> Exchange | None:
    alike = (exchange for exchange in waiting if exchange.request[0] == frame.command)
    return next((exchange for exchange in alike if at <= exchange.requested_at + _LONGEST_WAIT_S), None)


def _answers(events: Sequence[UartEvent], rest: list[Piece]) -> Iterator[_Answer]:
    """Yield MSP replies with the number of the event that completed each; `rest` gets all other received data."""
    for stretch in _stretches(events):
        done = 0
        for begin, end, frame in stretch.frames():
            rest += stretch.pieces(done, begin)
            done = end
            if frame.direction is Direction.REQUEST:
                # Our own request, from a looped-back line.
                rest += stretch.pieces(begin, end)
            else:
                yield stretch.number_at(end - 1), frame, stretch.pieces(begin, end)
        rest += stretch.pieces(done, stretch.size)


def _stretches(events: Sequence[UartEvent]) -> Iterator["_Stretch"]:
    """Yield the received data in stretches without a change of speed or a closed port."""
    reads: list[tuple[int, UartEvent]] = []
    offset = 0
    for number, event in enumerate(events):
        if reads and (event.speed != reads[-1][1].speed or event.action in (UartAction.OPEN, UartAction.CLOSE)):
            yield _Stretch(reads, offset)
            offset += sum(len(read.data) for _, read in reads)
            reads = []
        if event.action is UartAction.READ and event.data:
            reads.append((number, event))
    if reads:
        yield _Stretch(reads, offset)


class _Stretch:
    """Contiguous bytes, and the event of each. `offset`: the number of bytes read before."""

    def __init__(self, reads: Sequence[tuple[int, UartEvent]], offset: int) -> None:
        self._reads = reads
        self._offset = offset
        self._ends = list(accumulate(len(event.data) for _, event in reads))
        self.size = self._ends[-1]

    def frames(self) -> Iterator[tuple[int, int, MspFrame]]:
        """Yield each frame with its start and end."""
        data = b"".join(event.data for _, event in self._reads)
        end = 0
        for frame in MspParser().feed(data):
            encoded = frame.encode()
            begin = data.index(encoded, end)
            end = begin + len(encoded)
            yield begin, end, frame

    def number_at(self, at: int) -> int:
        """The number of the event that delivered a byte."""
        return self._reads[bisect_right(self._ends, at)][0]

    def pieces(self, begin: int, end: int) -> Sequence[Piece]:
        """A range of bytes, in pieces as read."""
        found: list[Piece] = []
        index = bisect_right(self._ends, begin)
        while begin < end:
            event, stop = self._reads[index][1], self._ends[index]
            start = stop - len(event.data)
            found.append((event.at, self._offset + begin, event.data[begin - start : end - start]))
            begin = stop
            index += 1
        return found
