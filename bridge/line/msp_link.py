# SPDX-License-Identifier: GPL-3.0-or-later
"""The request side of an MSP line: what may be sent when, how long to wait, what is still unanswered.

Harakiri's send ring holds 255 bytes and has no overflow check, so the sum of the replies that are still to come
is bounded. A flight controller that stood still answers all at once what was asked meanwhile, so a request that timed
out counts until something that was asked later is answered: requests are answered in their order.
Waiting time follows the measured round trip, as in TCP: 7/8 old + 1/8 measured, doubled on a loss.
"""

from collections import deque
from dataclasses import dataclass

from bridge.line.conversation import Send
from bridge.line.round_trips import RoundTrips
from protocols.frsky import FRSKY_SPEED
from protocols.msp.commands import Msp
from protocols.msp.frame import FRAME_OVERHEAD, Direction, MspFrame, MspParser, request
from protocols.msp.hazards import is_clean

#: Harakiri's ring less one heartbeat (25 bytes) that it may send of its own accord in AUTOSENSE, and some air.
MAX_OUTSTANDING_BYTES = 224
#: The same at the speed of FrSky telemetry, which an armed Harakiri puts into the ring as well: 13 bytes eight times a
#: second, and with GPS, barometer and time up to 85. While these bytes leave the ring two of its frames may join them.
_OUTSTANDING_BESIDE_FRSKY = 140
MIN_TIMEOUT_S = 0.06
MAX_TIMEOUT_S = 1.0
#: BEGIN and COMMIT erase and write flash: 100 ms and more during which the board does nothing else.
EXCLUSIVE_TIMEOUT_S = 1.0
#: Who stands still for longer is taken to have lost what it was asked: reset, or without power.
LONGEST_STALL_S = 3.0
#: What may be outstanding while it is not known whether it stands still: a resync and what follows need the rest.
_OUTSTANDING_IN_DOUBT = 64
_FIRST_GUESS_S = 0.03
#: After so long without a byte nothing more comes of a frame that has begun.
_LINE_SILENCE_S = 0.05
_ANY_SIZE = 1 << 16
_NO_COMMAND = -1
#: An INAV that lost a frame's header reads the rest as typed by hand: a '#' and then silence for 100 ms opens its
#: command line, an 'R' its boot loader. So after such a frame the line is not left silent: a harmless question follows.
_FOLLOW_UP_S = 0.04

#: Of a Harakiri, which does not know the second one; others are not so short of room.
_REPLY_SIZES = {Msp.IDENT: 7 + FRAME_OVERHEAD, Msp.FC_VARIANT: FRAME_OVERHEAD}
#: Fills a parser that waits for the rest of a cut frame (64 payload bytes and a checksum on an unpatched Harakiri),
#: with whole harmless frames. Their order has no period: eleven times the same, read by a receiver at a twelfth of the
#: speed, can come out as three '#' in a row (tests/bridge/test_probe_at_wrong_speed.py).
_RESYNC_COMMANDS = (
    *(Msp.FC_VARIANT, Msp.FC_VARIANT, Msp.IDENT, Msp.FC_VARIANT, Msp.IDENT, Msp.IDENT),
    *(Msp.IDENT, Msp.IDENT, Msp.FC_VARIANT, Msp.FC_VARIANT, Msp.IDENT),
)
#: Asks a board of any kind for a sign of life.
PROBE = request(Msp.IDENT)
RESYNC = b"".join(request(command) for command in _RESYNC_COMMANDS)
RESYNC_REPLY_SIZE = sum(_REPLY_SIZES[command] for command in _RESYNC_COMMANDS)
#: Asked for nothing but the order of its answer, so nobody else may ask it. Harakiri answers with an error; who says
#: nothing to what it does not know was never identified.
_QUESTION = Send(request(Msp.API_VERSION), Msp.API_VERSION, FRAME_OVERHEAD)


@dataclass(slots=True)
class _Request:
    """A request that was sent. No longer `awaited`, it may still be answered until the deadline."""

    command: int
    reply_size: int
    sent_at: float
    deadline: float
    exclusive: bool
    awaited: bool = True


class MspLink:
    """One MSP line. `baud` is None where the line has no speed (TCP, the built-in simulator).

    `owed`: bytes of answers to others that may still come first.
    """

    def __init__(self, baud: int | None, now: float, owed: int = 0) -> None:
        self._byte_s = 10 / baud if baud else 0.0
        self._ring_size = _OUTSTANDING_BESIDE_FRSKY if baud == FRSKY_SPEED else MAX_OUTSTANDING_BYTES
        self._parser = MspParser()
        self._waiting: deque[Send] = deque()
        self._sent: list[_Request] = []  # in the order in which they went out
        if owed:
            self._sent.append(
                _Request(_NO_COMMAND, owed, now, now + owed * self._byte_s, exclusive=False, awaited=False)
            )
        self._output: list[bytes] = []
        self._line_free_at = now
        self._round_trip_s = _FIRST_GUESS_S
        self._backoff = 1.0
        self._losses_in_a_row = 0
        self._resync_due = False
        self._last_byte_at = now
        self.last_heard_at = now
        #: Set from the flight controller's INFO; 0: its parser never gives up on a cut frame.
        self.receiver_timeout_s = 0.0
        #: Set where a frame may hold what a Harakiri must not be sent even in frames.
        self.any_byte = False
        self._follow_up_at: float | None = None
        self._risky: int | None = None  # the command of the frame that is followed up
        self.requests_lost = 0
        #: From a request's last byte on the wire to its reply.
        self.round_trips = RoundTrips()

    @property
    def outstanding_bytes(self) -> int:
        """Reply bytes that may still come."""
        return sum(sent.reply_size for sent in self._sent)

    def unanswered(self) -> list[tuple[float, int]]:
        """Return when what may still be answered was asked, and the sizes of the replies."""
        return [(sent.sent_at, sent.reply_size) for sent in self._sent]

    @property
    def round_trip_s(self) -> float:
        """Smoothed time from a request's last byte on the wire to its reply."""
        return self._round_trip_s

    @property
    def skipped_bytes(self) -> int:
        """Bytes that belonged to no frame."""
        return self._parser.skipped_bytes

    @property
    def bad_checksums(self) -> int:
        """Frames that came in damaged."""
        return self._parser.bad_checksums

    def awaits(self, commands: frozenset[int]) -> bool:
        """Tell whether a reply to one of `commands` is waited for, or will be when there is room to ask."""
        return any(sent.awaited and sent.command in commands for sent in self._sent) or any(
            message.command in commands for message in self._waiting
        )

    @property
    def room(self) -> int:
        """How long the reply to a request that goes out now may be."""
        if not self._sent and not self._waiting:
            return _ANY_SIZE
        if self._waiting or self._is_exclusive():
            return 0
        return self._limit - self.outstanding_bytes

    def send(self, message: Send, now: float) -> None:
        """Send a request as soon as the flight controller has room for its reply."""
        if not (self.any_byte or is_clean(message.frame)):
            # By construction this cannot happen (protocols.msp.hazards); if it did, silence is the safe answer.
            raise AssertionError(f"frame with a hazard byte: {message.frame.hex()}")
        self._waiting.append(message)
        self._flush(now)

    def take_output(self) -> list[bytes]:
        """Return what is to be written to the port, in order."""
        output, self._output = self._output, []
        return output

    def receive(self, data: bytes, now: float) -> list[MspFrame]:
        """Take bytes from the port; return the replies found, matched with their requests."""
        self._last_byte_at = now
        return self._take(self._parser.feed(data), now)

    def tick(self, now: float) -> list[MspFrame]:
        """Give up on requests whose time is over; return replies that were hidden behind a false header."""
        if self._follow_up_at is not None and now >= self._follow_up_at:
            self._ask(_QUESTION, now)
        if not any(now >= sent.deadline for sent in self._sent):
            return []
        hidden = self._parser.reset() if now >= self._last_byte_at + _LINE_SILENCE_S else []
        replies = self._take(hidden, now)
        self._sent = [sent for sent in self._sent if sent.awaited or now < sent.deadline]
        lost = [sent for sent in self._sent if now >= sent.deadline]
        for sent in lost:
            sent.awaited = False
            sent.deadline = sent.sent_at + LONGEST_STALL_S
        if lost:
            self.requests_lost += len(lost)
            self._losses_in_a_row += 1
            self._backoff = min(self._backoff * 2, 8.0)
            if self._losses_in_a_row % 2 == 0 and not self.receiver_timeout_s:
                self._resync_due = True
        self._flush(now)
        return replies

    def reply_deadline(self, commands: frozenset[int], now: float) -> float:
        """Return when to stop waiting for a reply to one of `commands`."""
        deadlines = [sent.deadline for sent in self._sent if sent.awaited and sent.command in commands]
        queued = any(message.command in commands for message in self._waiting)
        return max(deadlines, default=now + self._timeout_s() if queued else now)

    def next_deadline(self) -> float | None:
        """Return when `tick` has something to do."""
        deadlines = [sent.deadline for sent in self._sent]
        if self._follow_up_at is not None:
            deadlines.append(self._follow_up_at)
        return min(deadlines, default=None)

    def _timeout_s(self) -> float:
        floor = max(MIN_TIMEOUT_S, self.receiver_timeout_s + 0.02 if self.receiver_timeout_s else 0.0)
        return min(max(2 * self._round_trip_s, floor) * self._backoff, MAX_TIMEOUT_S)

    def _is_exclusive(self) -> bool:
        return any(sent.awaited and sent.exclusive for sent in self._sent)

    @property
    def _limit(self) -> int:
        is_in_doubt = any(not sent.awaited for sent in self._sent)
        return min(self._ring_size, _OUTSTANDING_IN_DOUBT) if is_in_doubt else self._ring_size

    def _has_room(self, reply_size: int) -> bool:
        return not self._sent or self.outstanding_bytes + reply_size <= self._limit

    def _fits_ring(self, reply_size: int) -> bool:
        return self.outstanding_bytes + reply_size <= self._ring_size

    def _flush(self, now: float) -> None:
        if self._resync_due and not self._is_exclusive() and self._fits_ring(RESYNC_REPLY_SIZE):
            self._resync(now)
        while self._waiting:
            message = self._waiting[0]
            if self._is_exclusive():
                return
            if not self._has_room(message.reply_size):
                if not any(sent.awaited for sent in self._sent) and self._fits_ring(_QUESTION.reply_size):
                    # Only what was given up is in the way: the answer to a short question behind it says it is over.
                    self._ask(_QUESTION, now)
                return
            self._waiting.popleft()
            self._ask(message, now)

    def _ask(self, message: Send, now: float) -> None:
        self._write(message.frame, now)
        if self.any_byte and not is_clean(message.frame):
            self._risky = message.command
            self._follow_up_at = self._line_free_at + _FOLLOW_UP_S
        patience = EXCLUSIVE_TIMEOUT_S if message.exclusive else self._timeout_s()
        reply_time = (self.outstanding_bytes + message.reply_size) * self._byte_s
        deadline = self._line_free_at + reply_time + patience
        self._sent.append(
            _Request(message.command, message.reply_size, self._line_free_at, deadline, message.exclusive)
        )

    def _resync(self, now: float) -> None:
        self._resync_due = False
        self._write(RESYNC, now)
        reply_time = (self.outstanding_bytes + RESYNC_REPLY_SIZE) * self._byte_s
        deadline = self._line_free_at + reply_time + MIN_TIMEOUT_S
        self._sent += [
            _Request(command, _REPLY_SIZES[command], self._line_free_at, deadline, exclusive=True)
            for command in _RESYNC_COMMANDS
        ]

    def _write(self, data: bytes, now: float) -> None:
        self._line_free_at = max(self._line_free_at, now) + len(data) * self._byte_s
        self._follow_up_at = None
        self._output.append(data)

    def _take(self, frames: list[MspFrame], now: float) -> list[MspFrame]:
        """Settle replies; a request that is heard is our own, from a line that is looped back."""
        replies = [frame for frame in frames if frame.direction is not Direction.REQUEST]
        for reply in replies:
            self.last_heard_at = now
            self._settle(reply, now)
        if replies:
            self._flush(now)
        return replies

    def _settle(self, reply: MspFrame, now: float) -> None:
        """Match a reply with its request. What was sent before that one is not answered any more."""
        alike = [sent for sent in self._sent if sent.command == reply.command]
        if not alike:
            return
        if reply.command == self._risky:
            self._follow_up_at = None
        oldest = alike[0]
        earlier = self._sent.index(oldest)
        self.requests_lost += sum(sent.awaited for sent in self._sent[:earlier])
        del self._sent[: earlier + 1]
        answered = next((sent for sent in alike if sent.awaited), None)
        if answered is None:
            return
        self._losses_in_a_row = 0
        self._backoff = 1.0
        if answered is not oldest:
            # Either may have been answered: this one is not waited for any more, and counts on.
            answered.awaited = False
        elif not answered.exclusive:
            measured = max(now - answered.sent_at, 0.0)
            self.round_trips.add(measured)
            self._round_trip_s += (measured - self._round_trip_s) / 8
