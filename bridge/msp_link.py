"""The request side of an MSP line: what may be sent when, how long to wait, what is still unanswered.

Harakiri's send ring holds 255 bytes and has no overflow check, so the sum of the replies that are still to come
is bounded. Waiting time follows the measured round trip, as in TCP: 7/8 old + 1/8 measured, doubled on a loss.
"""

from collections import deque
from dataclasses import dataclass

from bridge.procedure import Send
from protocols.msp.commands import Msp
from protocols.msp.frame import FRAME_OVERHEAD, MspFrame, MspParser, request
from protocols.msp.hazards import is_clean

#: Harakiri's ring less one heartbeat (25 bytes) that it may send of its own accord in AUTOSENSE, and some air.
MAX_OUTSTANDING_BYTES = 224
MIN_TIMEOUT_S = 0.06
MAX_TIMEOUT_S = 1.0
#: BEGIN and COMMIT erase and write flash: 100 ms and more during which the board does nothing else.
EXCLUSIVE_TIMEOUT_S = 1.0
_FIRST_GUESS_S = 0.03

#: Fills a parser that waits for the rest of a cut frame (64 payload bytes and a checksum on an unpatched Harakiri),
#: with whole harmless frames. Their replies, should all be understood, fit the send ring: 11 * 13 = 143 bytes.
RESYNC = request(Msp.IDENT) * 11
RESYNC_REPLY_SIZE = 11 * (7 + FRAME_OVERHEAD)


@dataclass(slots=True)
class _Pending:
    command: int
    reply_size: int
    sent_at: float
    deadline: float
    exclusive: bool


class MspLink:
    """One MSP line. `baud` is None where the line has no speed (TCP, the built-in simulator)."""

    def __init__(self, baud: int | None, now: float) -> None:
        self._byte_s = 10 / baud if baud else 0.0
        self._parser = MspParser()
        self._waiting: deque[Send] = deque()
        self._pending: list[_Pending] = []
        self._output: list[bytes] = []
        self._line_free_at = now
        self._round_trip_s = _FIRST_GUESS_S
        self._backoff = 1.0
        self._losses_in_a_row = 0
        self.last_heard_at = now
        #: Set from the flight controller's INFO; 0: its parser never gives up on a cut frame.
        self.receiver_timeout_s = 0.0
        self.requests_lost = 0

    @property
    def outstanding_bytes(self) -> int:
        """Reply bytes that are still to come."""
        return sum(pending.reply_size for pending in self._pending)

    @property
    def round_trip_s(self) -> float:
        """Smoothed time from a request's last byte on the wire to its reply."""
        return self._round_trip_s

    @property
    def bad_checksums(self) -> int:
        """Frames that came in damaged."""
        return self._parser.bad_checksums

    def awaits(self, commands: frozenset[int]) -> bool:
        """Tell whether a reply to one of `commands` is still to come."""
        return any(pending.command in commands for pending in self._pending)

    def may_send(self, reply_size: int) -> bool:
        """Tell whether a request with such a reply may go out now."""
        if any(pending.exclusive for pending in self._pending) or self._waiting:
            return False
        return self.outstanding_bytes + reply_size <= MAX_OUTSTANDING_BYTES

    def send(self, message: Send, now: float) -> None:
        """Send a request as soon as the flight controller has room for its reply."""
        if not is_clean(message.frame):
            # By construction this cannot happen (protocols.msp.hazards); if it did, silence is the safe answer.
            raise AssertionError(f"frame with a hazard byte: {message.frame.hex()}")
        self._waiting.append(message)
        self._flush(now)

    def take_output(self) -> list[bytes]:
        """Return what is to be written to the port, in order."""
        output, self._output = self._output, []
        return output

    def receive(self, data: bytes, now: float) -> list[MspFrame]:
        """Take bytes from the port; return the frames found, replies matched with their requests."""
        frames = self._parser.feed(data)
        for frame in frames:
            self.last_heard_at = now
            self._settle(frame, now)
        if frames:
            self._flush(now)
        return frames

    def tick(self, now: float) -> None:
        """Give up on requests whose time is over."""
        expired = [pending for pending in self._pending if now >= pending.deadline]
        if not expired:
            return
        self._pending = [pending for pending in self._pending if now < pending.deadline]
        self._parser.reset()
        self.requests_lost += len(expired)
        self._losses_in_a_row += 1
        self._backoff = min(self._backoff * 2, 8.0)
        if self._losses_in_a_row % 2 == 0 and not self.receiver_timeout_s:
            self._write(RESYNC, now)
            self._pending.append(
                _Pending(Msp.IDENT, RESYNC_REPLY_SIZE, now, self._line_free_at + MIN_TIMEOUT_S, exclusive=True)
            )
        self._flush(now)

    def reply_deadline(self, commands: frozenset[int], now: float) -> float:
        """Return when to stop waiting for a reply to one of `commands`."""
        deadlines = [pending.deadline for pending in self._pending if pending.command in commands]
        queued = any(message.command in commands for message in self._waiting)
        return max(deadlines, default=now + self._timeout_s() if queued else now)

    def next_deadline(self) -> float | None:
        """Return when `tick` has something to do."""
        return min((pending.deadline for pending in self._pending), default=None)

    def _timeout_s(self) -> float:
        floor = max(MIN_TIMEOUT_S, self.receiver_timeout_s + 0.02 if self.receiver_timeout_s else 0.0)
        return min(max(2 * self._round_trip_s, floor) * self._backoff, MAX_TIMEOUT_S)

    def _flush(self, now: float) -> None:
        while self._waiting:
            message = self._waiting[0]
            if any(pending.exclusive for pending in self._pending):
                return
            if self._pending and self.outstanding_bytes + message.reply_size > MAX_OUTSTANDING_BYTES:
                return
            self._waiting.popleft()
            self._write(message.frame, now)
            patience = EXCLUSIVE_TIMEOUT_S if message.exclusive else self._timeout_s()
            reply_time = (self.outstanding_bytes + message.reply_size) * self._byte_s
            deadline = self._line_free_at + reply_time + patience
            self._pending.append(
                _Pending(message.command, message.reply_size, self._line_free_at, deadline, message.exclusive)
            )

    def _write(self, data: bytes, now: float) -> None:
        self._line_free_at = max(self._line_free_at, now) + len(data) * self._byte_s
        self._output.append(data)

    def _settle(self, frame: MspFrame, now: float) -> None:
        for index, pending in enumerate(self._pending):
            if pending.command != frame.command:
                continue
            del self._pending[index]
            self._losses_in_a_row = 0
            self._backoff = 1.0
            if not pending.exclusive:
                measured = max(now - pending.sent_at, 0.0)
                self._round_trip_s += (measured - self._round_trip_s) / 8
            return
