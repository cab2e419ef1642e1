# SPDX-License-Identifier: GPL-3.0-or-later
"""The request side of an MSP line: when a request may be sent, how long to wait, which replies are pending.

Harakiri's send ring holds 255 bytes without an overflow check, so the total size of pending replies is bounded. After
a stall a flight controller answers all requests at once, in order, so a request that timed out stays pending until a
later one is answered. The timeout follows the measured round trip, as in TCP: 7/8 old + 1/8 measured, doubled on a
loss.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum, auto
from math import inf
from operator import attrgetter

from bridge.line.conversation import Send
from protocols.msp.command_line import EchoWatch
from protocols.msp.commands import Msp
from protocols.msp.frame import FRAME_OVERHEAD, Direction, MspFrame, MspParser, is_clean, request

#: Harakiri's ring, less one heartbeat (25 bytes) that it may send unprompted in AUTOSENSE, and a margin.
MAX_OUTSTANDING_BYTES = 224
#: The speed of FrSky telemetry, which a Harakiri armed with tele_prot 1 puts into the same ring, and the limit there:
#: 13 bytes eight times a second, up to 85 with GPS, barometer and time. Two of these frames may join the ring while
#: the replies leave it.
FRSKY_SPEED = 9600
_OUTSTANDING_BESIDE_FRSKY = 140
#: After a longer stall, pending requests are assumed lost: the board was reset or lost power.
_LONGEST_STALL_S = 3.0
MIN_TIMEOUT_S = 0.06
MAX_TIMEOUT_S = 1.0
#: BEGIN and COMMIT erase and write flash: the board stalls for 100 ms and more.
EXCLUSIVE_TIMEOUT_S = 1.0
#: The limit while the board may be stalled: the rest of the ring is kept for a resync and what follows.
_OUTSTANDING_IN_DOUBT = 64
_FIRST_GUESS_S = 0.03
#: An incomplete frame is dropped after this long without a byte.
_LINE_SILENCE_S = 0.05
#: If at least this many bytes of polled replies are missing, the port is not read until they can have arrived, but for
#: no longer than this.
_LEAST_WAITED_FOR, _LONGEST_WAIT_S = 8, 0.02
#: A board serves requests between two cycles of the control loop.
_SERVING_S = 0.004
_ANY_SIZE = 1 << 16
_NO_COMMAND = -1
#: An INAV that lost a frame's header takes the rest for typed characters: '#' followed by 100 ms of silence opens its
#: command line. So after a frame with such a byte the line is not left silent: a harmless request follows.
_FOLLOW_UP_S = 0.04

#: On Harakiri, which does not know the second command; other boards have larger rings.
_REPLY_SIZES = {Msp.IDENT: 7 + FRAME_OVERHEAD, Msp.FC_VARIANT: FRAME_OVERHEAD}
#: Fills a parser that waits for the rest of a cut frame (64 payload bytes and a checksum on an unpatched Harakiri),
#: with whole harmless frames. Their order is not periodic: eleven times the same, read by a receiver at a twelfth of
#: the speed, can come out as three '#' in a row (tests/bridge/fc/states/test_probe_at_wrong_speed.py).
_RESYNC_COMMANDS = (
    *(Msp.FC_VARIANT, Msp.FC_VARIANT, Msp.IDENT, Msp.FC_VARIANT, Msp.IDENT, Msp.IDENT),
    *(Msp.IDENT, Msp.IDENT, Msp.FC_VARIANT, Msp.FC_VARIANT, Msp.IDENT),
)
#: Asks a board of any kind for a sign of life.
PROBE = request(Msp.IDENT)
_COMMAND, _DEADLINE = attrgetter("command"), attrgetter("deadline")
_REPLY_SIZE, _MAY_WAIT = attrgetter("reply_size"), attrgetter("may_wait")
RESYNC = b"".join(request(command) for command in _RESYNC_COMMANDS)
RESYNC_REPLY_SIZE = sum(_REPLY_SIZES[command] for command in _RESYNC_COMMANDS)
#: Replies come in order: the reply to this shows that earlier replies are lost. No other code may use this command.
#: Harakiri answers with an error frame. A board that ignores unknown commands is never identified.
_QUESTION = Send(request(Msp.API_VERSION), Msp.API_VERSION, FRAME_OVERHEAD)

#: Constant while the same board is connected: API_VERSION, FC_VARIANT, FC_VERSION, BOARD_INFO, BUILD_INFO, IDENT,
#: BOXNAMES, PIDNAMES, BOXIDS, UID.
_CONSTANT = frozenset(map(request, (1, 2, 3, 4, 5, 100, 116, 117, 119, 160)))
#: More than a board has commands. The rest are requests with an index, whose replies are current for a moment only.
_MOST_REPLIES = 256


def byte_time_s(baud: int | None) -> float:
    """A byte's time on a line, with the start and stop bits, or 0 on a line without a speed."""
    return 10 / baud if baud else 0.0


class PendingReplies:
    """Replies that a silent board may send all at once when it resumes, in bytes, by the speed of their requests.

    While it is searched for, the replies to probes and to earlier requests must fit its ring together. It understands
    no request at a wrong speed.
    """

    def __init__(self) -> None:
        self._owed: dict[int | None, list[tuple[float, int]]] = {}  # until when, bytes; the oldest first

    def add(self, speed: int | None, size: int, asked_at: float) -> None:
        """Add a request whose reply has `size` bytes."""
        self._owed.setdefault(speed, []).append((asked_at + _LONGEST_STALL_S, size))

    def room(self, speed: int | None, now: float) -> int:
        """The largest reply that still fits, bytes."""
        return MAX_OUTSTANDING_BYTES - self.size(speed, now)

    def size(self, speed: int | None, now: float) -> int:
        """The bytes that may still arrive."""
        return sum(size for _, size in self._present(speed, now))

    def heard(self, speed: int | None, size: int, now: float) -> None:
        """The board has resumed with a reply of `size` bytes (0: with other data), so the rest is on its way."""
        rest: list[tuple[float, int]] = []
        left_ring_at = now
        for until, owed in self._present(speed, now):
            paid = min(owed, size)
            size -= paid
            if owed > paid:
                left_ring_at += (owed - paid) * byte_time_s(speed)
                rest.append((min(until, left_ring_at), owed - paid))
        self._owed = {speed: rest}

    def _present(self, speed: int | None, now: float) -> list[tuple[float, int]]:
        owed = [entry for entry in self._owed.get(speed, ()) if now < entry[0]]
        self._owed[speed] = owed
        return owed


class LastReplies:
    """The last reply to each request, including errors, by the request's frame."""

    def __init__(self) -> None:
        self._replies: dict[bytes, tuple[MspFrame, float]] = {}  # the command heard least recently first

    def heard(self, asked: bytes, reply: MspFrame, now: float) -> None:
        before, heard_at = self._replies.pop(asked, None), now
        if asked in _CONSTANT and before is not None and before[0] == reply:
            heard_at = inf  # heard twice: MSP's 8-bit checksum misses some damage
        elif len(self._replies) >= _MOST_REPLIES:
            del self._replies[next(iter(self._replies))]
        self._replies[asked] = reply, heard_at

    def get(self, asked: bytes, max_age_s: float, now: float) -> MspFrame | None:
        """The reply to a request if it is at most this old, or constant."""
        reply, heard_at = self._replies.get(asked, (None, now))
        return reply if now <= heard_at + max_age_s else None

    def forget(self) -> None:
        """Forget all replies, because the board was changed."""
        self._replies.clear()


class _Reply(Enum):
    """The state of a request's reply. In the last two it may still arrive, until the deadline."""

    AWAITED = auto()
    LOST = auto()  # it did not arrive in time
    DOUBTFUL = auto()  # this request or an equal one before it was answered


@dataclass(slots=True)
class _Request:
    """A request that was sent."""

    command: int
    reply_size: int
    sent_at: float
    deadline: float
    exclusive: bool
    reply: _Reply = _Reply.AWAITED
    #: The frame, if the reply is kept.
    kept: bytes | None = None
    may_wait: bool = False

    @property
    def size_in_ring(self) -> int:
        """A board that sends longer replies has a larger ring: after a loss there is room for a short question."""
        return min(self.reply_size, MAX_OUTSTANDING_BYTES - _QUESTION.reply_size)


class MspLink:
    """One MSP line. `baud` is None on a line without a speed (TCP, the built-in simulator).

    >>> link.send(Send(request(Msp.IDENT), Msp.IDENT, reply_size=13), now)
    >>> replies = link.receive(port.read(512), now)  # and link.tick(now) at link.due

    `output`: gets the bytes to be written to the port, in order. `owed`: bytes of earlier replies that may still arrive
    first.
    """

    def __init__(self, baud: int | None, output: list[bytes], now: float, owed: int = 0) -> None:
        self._baud = baud
        self.output = output
        #: A byte's time on the line.
        self.byte_s = byte_time_s(baud)
        self._ring_size = _OUTSTANDING_BESIDE_FRSKY if baud == FRSKY_SPEED else MAX_OUTSTANDING_BYTES
        #: Counts damaged frames, and bytes outside frames.
        self.parser = MspParser()
        self._waiting: deque[Send] = deque()
        self._sent: list[_Request] = []  # in sending order
        if owed:
            left_ring_at = now + owed * self.byte_s
            self._sent.append(_Request(_NO_COMMAND, owed, now, left_ring_at, exclusive=False, reply=_Reply.LOST))
        self._line_free_at = now
        #: The smoothed time from a request's last byte on the wire to the reply.
        self.round_trip_s = _FIRST_GUESS_S
        self._backoff = 1.0
        self._losses_in_a_row = 0
        self._resync_due = False
        self._last_byte_at = now
        self.last_heard_at = now
        #: From the flight controller's INFO, or 0 if the parser never gives up on a cut frame.
        self.receiver_timeout_s = 0.0
        #: Set for boards that accept any byte inside a frame.
        self.any_byte = False
        #: Set for boards that serve one request at a time: the interval, s.
        self.turn_s = 0.0
        self._follow_up_at = inf
        self._risky: int | None = None  # the command of the frame that is followed up
        self.requests_lost = 0
        self.replies = LastReplies()
        #: Knows the requests that were sent.
        self.echo = EchoWatch()

    @property
    def outstanding_bytes(self) -> int:
        return sum(map(_REPLY_SIZE, self._sent))

    def unanswered(self) -> PendingReplies:
        pending = PendingReplies()
        for sent in self._sent:
            pending.add(self._baud, sent.size_in_ring, sent.sent_at)
        return pending

    def owes(self, command: int) -> bool:
        """True if a reply to `command` may still arrive, however late, or its request is queued."""
        return any(sent.command == command for sent in self._sent) or any(
            message.command == command for message in self._waiting
        )

    def awaits(self, command: int) -> bool:
        """True if a reply to `command` is awaited, or its request is queued."""
        return any(sent.command == command and sent.reply is _Reply.AWAITED for sent in self._sent) or any(
            message.command == command for message in self._waiting
        )

    @property
    def room(self) -> int:
        """The largest reply that a request may have to be sent now, bytes."""
        return 0 if self._waiting else self._room_in_ring()

    def send(self, message: Send, now: float) -> None:
        """Send a request as soon as the flight controller has room for the reply."""
        if not (self.any_byte or is_clean(message.frame)):
            # Impossible by construction (protocols.msp.command_line). If it did happen, not sending is safe.
            raise AssertionError(f"frame with a hazard byte: {message.frame.hex()}")
        self._waiting.append(message)
        self._flush(now)

    def receive(self, data: bytes, now: float) -> list[MspFrame]:
        """Take bytes from the port. Return the replies, matched with their requests."""
        self._last_byte_at = now
        frames = self.parser.feed(data)
        return self._take(frames, now) if frames else frames

    def tick(self, now: float) -> list[MspFrame]:
        """Time out requests. Return replies that a false header had hidden."""
        if now >= self._follow_up_at:
            self._ask(_QUESTION, now)
        if not self._sent or now < min(map(_DEADLINE, self._sent)):
            return []
        hidden = self.parser.reset() if now >= self._last_byte_at + _LINE_SILENCE_S else []
        replies = self._take(hidden, now)
        self._sent = [sent for sent in self._sent if sent.reply is _Reply.AWAITED or now < sent.deadline]
        lost = [sent for sent in self._sent if now >= sent.deadline]
        for sent in lost:
            sent.reply, sent.deadline = _Reply.LOST, sent.sent_at + _LONGEST_STALL_S
        if lost:
            self.requests_lost += len(lost)
            self._losses_in_a_row += 1
            self._backoff = min(self._backoff * 2, 8.0)
            if self._losses_in_a_row % 2 == 0 and not self.receiver_timeout_s:
                self._resync_due = True
        self._flush(now)
        return replies

    def reply_deadline(self, commands: frozenset[int], now: float) -> float:
        """When a reply to one of `commands` counts as lost."""
        latest = 0.0
        for sent in self._sent:
            if sent.command in commands and sent.reply is _Reply.AWAITED:
                latest = max(latest, sent.deadline)
        if latest:
            return latest
        is_queued = any(message.command in commands for message in self._waiting)
        return now + self._timeout_s() if is_queued else now

    @property
    def due(self) -> float:
        """The time of the next `tick`, or infinity without a pending request."""
        return min(self._follow_up_at, *map(_DEADLINE, self._sent)) if self._sent else self._follow_up_at

    @property
    def complete_at(self) -> float:
        """Before this time only a part of the awaited replies can have arrived; -infinity if they must not wait.

        A slow line delivers a long reply in pieces, and several replies one by one. Polled replies are read together. A
        queued request is sent as soon as a reply leaves room for it.
        """
        if self._waiting or not (self.byte_s and self._sent and all(map(_MAY_WAIT, self._sent))):
            return -inf
        size = sum(map(_REPLY_SIZE, self._sent)) - self.parser.incomplete_bytes
        if size < _LEAST_WAITED_FOR:
            return -inf
        first, last = self._sent[0], self._sent[-1]
        begins_at = max(self._last_byte_at, first.sent_at + _SERVING_S)
        complete_at: float = max(begins_at + size * self.byte_s, last.sent_at + last.reply_size * self.byte_s)
        # Received bytes are read before a request counts as lost.
        lost_at: float = min(map(_DEADLINE, self._sent))
        return min(complete_at, begins_at + _LONGEST_WAIT_S, lost_at)

    def _timeout_s(self) -> float:
        floor = max(MIN_TIMEOUT_S, self.receiver_timeout_s + 0.02 if self.receiver_timeout_s else 0.0)
        return min(max(2 * self.round_trip_s, floor) * self._backoff, MAX_TIMEOUT_S)

    def _room_in_ring(self) -> int:
        if not self._sent:
            return _ANY_SIZE
        pending, limit = 0, self._ring_size
        for sent in self._sent:
            pending += sent.reply_size
            if sent.reply is not _Reply.AWAITED:
                limit = min(self._ring_size, _OUTSTANDING_IN_DOUBT)
            elif sent.exclusive:
                return 0
        return limit - pending

    def _fits_ring(self, reply_size: int) -> bool:
        return sum([sent.size_in_ring for sent in self._sent]) + reply_size <= self._ring_size

    def _flush(self, now: float) -> None:
        if self._resync_due and self._fits_ring(RESYNC_REPLY_SIZE):
            self._resync(now)
        while self._waiting:
            message = self._waiting[0]
            if message.reply_size > self._room_in_ring():
                if all(sent.reply is _Reply.LOST for sent in self._sent) and self._fits_ring(_QUESTION.reply_size):
                    # Only lost requests block this request: the reply to a short request behind them clears them.
                    self._ask(_QUESTION, now)
                return
            self._waiting.popleft()
            self._ask(message, now)

    def _ask(self, message: Send, now: float) -> None:
        self._write(message.frame, now)
        if self.any_byte and not is_clean(message.frame):
            self._risky = message.command
            self._follow_up_at = self._line_free_at + _FOLLOW_UP_S
        timeout_s = EXCLUSIVE_TIMEOUT_S if message.exclusive else self._timeout_s()
        pending = sum(map(_REPLY_SIZE, self._sent))
        reply_time = (pending + message.reply_size) * self.byte_s + len(self._sent) * self.turn_s
        deadline = self._line_free_at + reply_time + timeout_s
        sent = _Request(message.command, message.reply_size, self._line_free_at, deadline, message.exclusive)
        sent.kept = message.frame if message.is_kept else None
        sent.may_wait = message.may_wait
        self._sent.append(sent)

    def _resync(self, now: float) -> None:
        if any(sent.exclusive and sent.reply is _Reply.AWAITED for sent in self._sent):
            return
        self._resync_due = False
        self._write(RESYNC, now)
        reply_time = (self.outstanding_bytes + RESYNC_REPLY_SIZE) * self.byte_s
        deadline = self._line_free_at + reply_time + MIN_TIMEOUT_S
        self._sent += [
            _Request(command, _REPLY_SIZES[command], self._line_free_at, deadline, exclusive=True)
            for command in _RESYNC_COMMANDS
        ]

    def _write(self, data: bytes, now: float) -> None:
        self._line_free_at = max(self._line_free_at, now) + len(data) * self.byte_s
        self._follow_up_at = inf
        self.output.append(data)
        self.echo.sent.append(data)

    def _take(self, frames: list[MspFrame], now: float) -> list[MspFrame]:
        """Match the replies. Requests are our own, from a looped-back line."""
        replies: list[MspFrame] = []
        for frame in frames:
            if frame.direction is not Direction.REQUEST:
                self._settle(frame, now)
                replies.append(frame)
        if replies:
            self.last_heard_at = now
            if self._waiting or self._resync_due:
                self._flush(now)
        return replies

    def _settle(self, reply: MspFrame, now: float) -> None:
        """Match a reply with its request. Earlier requests will no longer be answered."""
        command = reply.command
        for oldest in self._sent:
            if oldest.command == command:
                break
        else:
            return
        earlier = self._sent.index(oldest)
        if command == self._risky:
            self._follow_up_at = inf
        if earlier:
            overtaken = self._sent[:earlier]
            self.requests_lost += sum([sent.reply is _Reply.AWAITED for sent in overtaken])
        del self._sent[: earlier + 1]
        answered: _Request | None = oldest
        if oldest.reply is not _Reply.AWAITED:
            equal = (sent for sent in self._sent if sent.command == command and sent.reply is _Reply.AWAITED)
            answered = next(equal, None)
        elif oldest.kept and (command not in map(_COMMAND, self._sent) or self._is_certain(oldest)):
            self.replies.heard(oldest.kept, reply, now)
        if answered is None:
            return
        self._losses_in_a_row = 0
        self._backoff = 1.0
        if answered is not oldest:
            answered.reply = _Reply.DOUBTFUL
            answered.deadline = min(answered.deadline, now + self.outstanding_bytes * self.byte_s + self.round_trip_s)
        elif not answered.exclusive:
            measured = max(now - answered.sent_at, 0.0)
            self.round_trip_s += (measured - self.round_trip_s) / 8

    def _is_certain(self, answered: _Request) -> bool:
        """False if the reply may be to a later request of the same command, with another index."""
        return not any(sent.command == answered.command and sent.kept != answered.kept for sent in self._sent)
