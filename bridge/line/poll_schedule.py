# SPDX-License-Identifier: GPL-3.0-or-later
"""The schedule of telemetry polls. Sans-IO.

Each poll has a requested interval: the fastest that a ground station asked for or the bridge itself needs. The line
may stretch it: requests and replies together get a share of the bytes, or of the board's time if that is scarcer
(missions and commands have the rest), and lost replies slow all polls down until they arrive again. A poll is repeated
only after the reply has arrived or timed out, so a long round trip slows the fast polls down by itself.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from operator import attrgetter

from bridge.line.conversation import Send
from bridge.line.msp_link import MspLink
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, frame_size, request
from protocols.msp.telemetry import STATUS_SIZE

#: Telemetry's share of the line, both directions added.
_LINE_SHARE = 0.6
#: Requests may use their share of this time in one burst.
_BURST_S = 0.05
#: The part of that share reserved for STATUS: arming must be noticed at any speed.
_STATUS_SHARE = 0.25
#: A line without a speed (TCP) has a UART somewhere behind it. This is Harakiri's default.
_ASSUMED_BAUD = 115200
#: The factor for all rates during a mission transfer.
_BESIDE_MISSIONS = 0.2
#: No poll gets slower than this.
_SLOWEST_S = 5.0
#: The interval of polls that other programs ask for, until they were silent for this long.
_FOLLOWED_S, _FOLLOWED_FOR_S = 0.1, 3.0
#: A reply is current for one interval, or for this long.
_CURRENT_S = 1.0
#: Together with one that is due, polls are sent that will be due within this part of their interval, and this time:
#: every wake-up costs CPU time. For the same reason a poll that the line does not slow down is due at multiples of the
#: interval: at the default rates all others join ATTITUDE.
_EARLY, _EARLIEST_S = 0.2, 0.05
#: Replies to polls with at least this interval may be read together. A client of faster polls needs fresh values.
_MAY_WAIT_S = 0.08
#: A poll's first lost reply reduces all rates by a tenth, and each received reply restores a little: 1 % losses have
#: no effect, 10 % halve the rates.
_LOSS_FACTOR = 0.9
_RECOVERY = 0.005
_WORST_QUALITY = 0.1
#: After this many unanswered requests in a row, while others are answered, a poll backs off.
_TOLERATED_MISSES = 4
#: After this many error frames in a row the command is unknown to the board. One alone may be line noise.
_REFUSALS = 2
_MAX_DOUBLINGS = 6
_HALVINGS = 12
_LEAST_SCALE = 1e-3


@dataclass(frozen=True, slots=True)
class Poll:
    """One telemetry request. reply_payload: the longest, bytes. needed_s: the interval that the bridge itself needs."""

    command: Msp
    frame: bytes
    reply_payload: int
    needed_s: float


#: STATUS is polled most often: arming must be noticed during a mission transfer.
POLLS = (
    Poll(Msp.STATUS, request(Msp.STATUS), STATUS_SIZE, 0.25),
    Poll(Msp.ATTITUDE, request(Msp.ATTITUDE), 8, 1.0),
    Poll(Msp.RAW_GPS, request(Msp.RAW_GPS), 18, 1.0),
    Poll(Msp.ALTITUDE, request(Msp.ALTITUDE), 10, 1.0),
    Poll(Msp.ANALOG, request(Msp.ANALOG), 9, 1.0),
    Poll(Msp.RC, request(Msp.RC), 68, 1.0),
    Poll(Msp.WP, request(Msp.WP, b"\0"), 21, 2.0),
    # For other programs only.
    Poll(Msp.MOTOR, request(Msp.MOTOR), 16, inf),
    Poll(Msp.RAW_IMU, request(Msp.RAW_IMU), 18, inf),
    Poll(Msp.SERVO, request(Msp.SERVO), 16, inf),
    Poll(Msp.COMP_GPS, request(Msp.COMP_GPS), 5, inf),
    Poll(Msp.DEBUG, request(Msp.DEBUG), 16, inf),
)
#: Asked where the switches must be known in flight. The longest reply is that of 15 boxes with six aux channels.
BOX_POLL = Poll(Msp.BOX, request(Msp.BOX), 60, 5.0)
#: For boards that report their progress in a mission.
NAV_POLL = Poll(Msp.NAV_STATUS, request(Msp.NAV_STATUS), 7, 0.5)


@dataclass(slots=True)
class _Slot:
    """One poll in the schedule. `least_cost`: the bytes that the line could carry while the board serves a request."""

    poll: Poll
    least_cost: float
    request: Send = field(init=False)
    cost: float = field(init=False)
    reply_payload: int = field(init=False)
    wanted_s: float = inf
    followed_until: float = -inf
    interval_s: float = inf
    early_s: float = 0.0
    asked_at: float = -inf
    due: float = -inf
    is_asked: bool = False
    misses: int = 0
    refusals: int = 0

    def __post_init__(self) -> None:
        self.expect(self.poll.reply_payload)  # until one was seen

    @property
    def is_unknown(self) -> bool:
        """True if the board refuses it."""
        return self.refusals >= _REFUSALS

    @property
    def is_followed(self) -> bool:
        return self.followed_until > -inf

    @property
    def backoff(self) -> float:
        """The factor for the interval while it is not answered."""
        return float(2 ** min(max(self.misses - _TOLERATED_MISSES, 0), _MAX_DOUBLINGS))

    def expect(self, reply_payload: int) -> None:
        """Set the reply's payload, bytes. Its cost is that of both frames, or the board's time if that is longer."""
        self.reply_payload = reply_payload
        size = frame_size(self.poll.command, reply_payload)
        self.request = Send(self.poll.frame, self.poll.command, size, is_kept=True)
        self.cost = max(len(self.poll.frame) + size, self.least_cost)

    def set_interval(self, interval_s: float) -> None:
        self.interval_s = interval_s
        may_wait = interval_s >= _MAY_WAIT_S
        if may_wait is not self.request.may_wait:
            self.request = replace(self.request, may_wait=may_wait)
        self.early_s = min(interval_s * _EARLY, _EARLIEST_S)
        self._set_due()

    def asked(self, now: float) -> None:
        """The request was sent. The next is due one interval after this one was due, unless that is long past."""
        self.is_asked = True
        self.asked_at = now if now >= self.due + self.interval_s else self.due
        self._set_due()

    def _set_due(self) -> None:
        if self.interval_s == self.wanted_s < inf and self.asked_at > -inf:
            self.due = (round(self.asked_at / self.interval_s) + 1) * self.interval_s
        else:
            self.due = inf if self.interval_s == inf else self.asked_at + self.interval_s

    def may_be_asked_at(self, link: MspLink, room: int) -> float:
        """When the link would take it, or infinity if the link must change first."""
        if self.is_asked and link.awaits(self.poll.command):
            return inf
        if self.request.reply_size <= room:
            return self.due
        # A late STATUS joins the link's queue, ahead of later mission requests.
        return self.due + self.interval_s if self.poll.command is Msp.STATUS else inf


_DUE = attrgetter("due")


class PollSchedule:
    """The schedule of one line.

    >>> polls.begin(115200)  # a flight controller is found
    >>> polls.want({Msp.ATTITUDE: 0.1})  # a ground station wants it ten times a second
    >>> polls.ask(link, now, beside_missions=False)  # at polls.due(link), and after each reply
    """

    def __init__(self) -> None:
        self._wanted: Mapping[Msp, float] = {}
        self._slots: dict[int, _Slot] = {}
        #: The commands that are polled.
        self.commands: Collection[int] = ()
        self._budget = 0.0
        self._least_cost = 0.0
        self._line_scale = 1.0
        self._unfollowed_at = inf  # when programs stop asking for a poll
        self._quality = 1.0
        self._free_at = 0.0
        self._asked_at = -inf
        self._lost_before = 0
        self._beside_missions = False

    def begin(self, baud: int | None, polls: Sequence[Poll] = POLLS, turn_s: float = 0.0) -> None:
        """Start polling a flight controller: everything once, then at the requested intervals.

        `turn_s`: it serves one request in this time.
        """
        bytes_per_s = (baud or _ASSUMED_BAUD) / 10
        self._budget = bytes_per_s * _LINE_SHARE
        self._quality = 1.0
        self._lost_before = 0
        self._least_cost = turn_s * bytes_per_s
        self._slots = {poll.command: _Slot(poll, self._least_cost) for poll in polls}
        self.commands = self._slots.keys()
        self._fit()

    def want(self, wanted: Mapping[Msp, float]) -> None:
        """Set the requested intervals, seconds by command. The bridge's own needs are added."""
        if wanted != self._wanted:
            self._wanted = wanted
            self._fit()

    def follow(self, command: int, frame: bytes, now: float) -> float | None:
        """Poll for another program as long as it asks. Returns None if this request is not a poll.

        Returns the age up to which the last reply is current, seconds.
        """
        slot = self._slots.get(command)
        if slot is None or frame != slot.poll.frame:
            return None
        is_new = not slot.is_followed
        slot.followed_until = now + _FOLLOWED_FOR_S
        self._unfollowed_at = min(self._unfollowed_at, slot.followed_until)
        if is_new:
            self._fit()
        return inf if slot.is_unknown else max(slot.interval_s, _CURRENT_S)

    def rest_s(self, size: int) -> float:
        """The time in which the rest of the line carries a request and the reply, together `size` bytes."""
        return max(size, self._least_cost) / (self._budget / _LINE_SHARE - self._budget)

    def interval_s(self, command: Msp) -> float | None:
        """The current interval of a poll, seconds, or None if it is not polled."""
        slot = self._slots.get(command)
        return None if slot is None or slot.interval_s == inf else slot.interval_s

    def line_interval_s(self, command: Msp) -> float:
        """The interval that the line's speed, losses and missions allow, seconds, or 0 if it is not polled."""
        slot = self._slots.get(command)
        return 0.0 if slot is None or slot.wanted_s == inf else self._present_interval(slot, backoff=1.0)

    def ask(self, link: MspLink, now: float, *, beside_missions: bool) -> None:
        """Send the requests that are due, and those nearly due with them, as far as the link has room."""
        self._look_at(link, beside_missions, now)
        self._asked_at = now
        slots = self._slots.values()
        if min(map(_DUE, slots), default=inf) > now:
            return
        room = link.room
        for slot in sorted([slot for slot in slots if slot.due - slot.early_s <= now], key=_DUE):
            if now < self._free_at:
                return
            if slot.may_be_asked_at(link, room) > now + slot.early_s:
                continue
            slot.asked(now)
            self._free_at = max(self._free_at, now - _BURST_S) + slot.cost / self._budget
            link.send(slot.request, now)
            room = link.room

    def answered(self, frame: MspFrame) -> None:
        """Take a reply to a command that is polled."""
        slot = self._slots[frame.command]
        slot.is_asked = False
        is_slowed = slot.misses > _TOLERATED_MISSES or self._quality < 1
        slot.misses = 0
        self._quality = min(self._quality + _RECOVERY, 1.0)
        if frame.direction is Direction.ERROR:
            slot.refusals += 1
            self._fit()
        elif slot.refusals or len(frame.payload) != slot.reply_payload:
            slot.refusals = 0
            slot.expect(len(frame.payload))
            self._fit()
        elif is_slowed:
            # The other polls are adjusted with their own replies.
            slot.set_interval(self._present_interval(slot))

    def due(self, link: MspLink) -> float:
        """The time of the next request, or infinity if a reply must arrive first."""
        earliest = min(map(_DUE, self._slots.values()), default=inf)
        if earliest > self._asked_at:
            # Until then the previous reply will probably have arrived, and the link will have room.
            return max(earliest, self._free_at)
        room = link.room
        earliest = inf
        for slot in sorted(self._slots.values(), key=_DUE):
            if slot.due >= earliest:
                break
            earliest = min(earliest, slot.may_be_asked_at(link, room))
        return max(earliest, self._free_at)

    def _look_at(self, link: MspLink, beside_missions: bool, now: float) -> None:
        if now >= self._unfollowed_at:
            for slot in self._slots.values():
                slot.followed_until = slot.followed_until if now < slot.followed_until else -inf
            self._unfollowed_at = min((s.followed_until for s in self._slots.values() if s.is_followed), default=inf)
            self._fit()
        asked = self._slots.values() if link.requests_lost != self._lost_before else ()
        self._lost_before = link.requests_lost
        lost = [slot for slot in asked if slot.is_asked and not link.awaits(slot.poll.command)]
        if lost or beside_missions != self._beside_missions:
            for slot in lost:
                slot.is_asked = False
                slot.misses += 1
            # A poll or other request that the board does not answer is not a loss of the line.
            first = [slot for slot in lost if slot.misses == 1]
            self._quality = max(self._quality * _LOSS_FACTOR ** len(first), _WORST_QUALITY)
            self._beside_missions = beside_missions
            self._set_intervals()
            for slot in first:
                slot.due = min(slot.due, now)  # asked again at once: a single loss does not make a value stale

    def _fit(self) -> None:
        """Scale the requested rates to the line."""
        for slot in self._slots.values():
            followed_s = _FOLLOWED_S if slot.is_followed else inf
            wanted_s = min(self._wanted.get(slot.poll.command, inf), slot.poll.needed_s, followed_s)
            slot.wanted_s = inf if slot.is_unknown else wanted_s
        self._line_scale = 1.0
        if self._bytes_per_s(1.0) > self._budget:
            step, self._line_scale = 0.5, _LEAST_SCALE
            for _ in range(_HALVINGS):
                if self._bytes_per_s(self._line_scale + step) <= self._budget:
                    self._line_scale += step
                step /= 2
        self._set_intervals()

    def _bytes_per_s(self, scale: float) -> float:
        return sum(slot.cost / self._interval(slot, scale) for slot in self._slots.values())

    def _set_intervals(self) -> None:
        for slot in self._slots.values():
            slot.set_interval(self._present_interval(slot))

    def _present_interval(self, slot: _Slot, backoff: float | None = None) -> float:
        scale = self._quality * (_BESIDE_MISSIONS if self._beside_missions else 1.0)
        return self._interval(slot, self._line_scale * scale, backoff)

    def _interval(self, slot: _Slot, scale: float, backoff: float | None = None) -> float:
        is_status = slot.poll.command is Msp.STATUS
        slowest = slot.cost / (self._budget * _STATUS_SHARE) if is_status else _SLOWEST_S
        return min(slot.wanted_s / scale * (backoff or slot.backoff), max(slot.wanted_s, slowest))
