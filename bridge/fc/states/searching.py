# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the protocol and speed of a serial port. Sans-IO.

A disarmed Harakiri sends MAVLink heartbeats until it receives something, and answers both protocols. Armed, it may
speak MAVLink only. So the search listens for both, but probes for MSP and prefers it.

Each visit to a speed first only listens, then probes as well. An MSP reply is confirmed by a second one. Evidence is
two equal replies to our own probes, an autopilot's heartbeat, or two MAVLink frames of one autopilot. Noise
produces none of them (test_autosense_noise.py). A board that echoes our probes is in the command line.
Only whole IDENT requests are ever sent. At a wrong speed the flight controller receives different bytes;
test_probe_at_wrong_speed.py shows that none of them makes a run that Harakiri acts on.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import cycle, islice

from bridge.fc.profile import Spoken
from bridge.fc.states.base import Event, FcLine, Found, Lost, PortOpened, State
from bridge.line.msp_link import PROBE, RESYNC, RESYNC_REPLY_SIZE, PendingReplies, byte_time_s
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter, is_autopilot_heartbeat
from protocols.msp.command_line import EchoWatch
from protocols.msp.commands import Msp
from protocols.msp.frame import FRAME_OVERHEAD, Direction, MspFrame, MspParser

#: Tried in this order; 115200, Harakiri's default, is tried twice, for a board that was still booting.
SPEEDS = (115200, 57600, 38400, 115200, 19200, 9600, 4800, 2400, 1200)
#: At these speeds a visit lasts long enough for a 1 Hz heartbeat; at others for the replies to two probes.
_HEARTBEAT_SPEEDS = (115200, 57600)
_FULL_VISIT_S = 1.1
_LISTEN_S = 0.1
_PROBE_INTERVAL_S = 0.15
_CONFIRM_S = 0.3
_ANSWER_SIZE = 13
#: Of autopilots, and of a Harakiri. A radio sends as another, and so does the ground station at its other end.
_AUTOPILOT_COMPIDS = (1, 200)
#: A command line's echo of one probe: `$M<dd`.
_ECHO_SIZE = 5


def visit_order(
    speeds: Sequence[int | None], good: Sequence[int | None], first: Sequence[int | None]
) -> Iterator[int | None]:
    """Yield speeds forever: `first` once, then the good speeds, as a board returns to them, before each other."""
    yield from first
    others = cycle(speed for speed in speeds if speed not in good)
    while True:
        yield from good
        yield from islice(others, 1)


@dataclass(slots=True)
class _Visit:
    """The data heard at one speed, and the end times of the phase and the visit."""

    phase_ends: float
    ends: float
    msp: MspParser = field(default_factory=MspParser)
    mavlink: MavlinkSplitter = field(default_factory=MavlinkSplitter)
    probes: int = 0
    answer: MspFrame | None = None
    heartbeat: MavlinkFrame | None = None
    last_mavlink: MavlinkFrame | None = None
    echo: EchoWatch = field(default_factory=EchoWatch)


class Searching(State):
    """The protocol and speed are being searched for."""

    name = "searching"

    def __init__(self, fc_line: FcLine, event: PortOpened | Lost, now: float) -> None:
        super().__init__(fc_line, event, now)
        first, self.pending = (event.first, event.pending) if isinstance(event, Lost) else ((), PendingReplies())
        first = [speed for speed in first if speed in fc_line.speeds]
        self._order = visit_order(fc_line.speeds, tuple(fc_line.good_speeds), first)
        self.speed = next(self._order)
        self.found: Found | None = None
        self._visit = self._new_visit(now)

    @property
    def due(self) -> float:
        return min(self._visit.phase_ends, self._visit.ends)

    def receive(self, data: bytes, now: float) -> Event | None:
        for msp_frame in self._visit.msp.feed(data):
            self._msp_frame(msp_frame, now)
        for mavlink_frame in self._visit.mavlink.feed(data):
            self._mavlink_frame(mavlink_frame, now)
        self._visit.echo.feed(data)
        if not self.found and self._visit.echo.is_echo():
            self._conclude(Spoken.CLI, "it echoes our probes")
        return self.found

    def tick(self, now: float) -> Event | None:
        visit = self._visit
        if self.found:
            return self.found
        if now >= visit.ends:
            if visit.heartbeat is not None:
                sender = f"system {visit.heartbeat.sysid} component {visit.heartbeat.compid}"
                why = f"heard {sender}, no answer to {visit.probes} MSP probes"
                self._conclude(self.fc_line.mavlink_of(visit.heartbeat), why)
            else:
                self.speed = next(self._order)
                self._visit = self._new_visit(now)
        elif now >= visit.phase_ends:
            visit.answer = None
            visit.phase_ends = now + self._probe(now)
        return self.found

    def _new_visit(self, now: float) -> _Visit:
        listened = now + _LISTEN_S
        full = self.speed is None or self.speed in _HEARTBEAT_SPEEDS
        return _Visit(listened, now + _FULL_VISIT_S if full else listened + self._two_probes_s())

    def _two_probes_s(self) -> float:
        """The time for both kinds of probe and their replies."""
        return self._on_wire_s(PROBE) + self._on_wire_s(RESYNC) + 2 * _PROBE_INTERVAL_S

    def _probe(self, now: float) -> float:
        """Send a probe if there is room for the reply. Return the time to wait for it."""
        room = self.pending.room(self.speed, now)
        # Every second probe also fills a parser that is stuck in the middle of a frame. A command line is not filled.
        is_typed = self._visit.echo.is_echo(_ECHO_SIZE)
        if self._visit.probes % 2 and not is_typed and room >= RESYNC_REPLY_SIZE:
            return self._ask(RESYNC, RESYNC_REPLY_SIZE, now) + _PROBE_INTERVAL_S
        if room >= _ANSWER_SIZE:
            self._visit.echo.sent.append(PROBE)
            return self._ask(PROBE, _ANSWER_SIZE, now) + _PROBE_INTERVAL_S
        return _PROBE_INTERVAL_S

    def _ask(self, frame: bytes, reply_size: int, now: float) -> float:
        """Send a probe. Return the time that it and the reply take on the wire."""
        self._visit.probes += 1
        self.pending.add(self.speed, reply_size, now)
        self.fc_line.output.append(frame)
        return self._on_wire_s(frame)

    def _on_wire_s(self, frame: bytes) -> float:
        """The time of a probe and one reply on the wire: long at 1200 baud."""
        return (len(frame) + _ANSWER_SIZE) * byte_time_s(self.speed)

    def _msp_frame(self, frame: MspFrame, now: float) -> None:
        visit = self._visit
        if frame.direction is not Direction.REQUEST:
            self.pending.heard(self.speed, len(frame.payload) + FRAME_OVERHEAD, now)
        if self.found or frame.command != Msp.IDENT or frame.direction is Direction.REQUEST:
            return
        if visit.answer == frame:
            self._conclude(Spoken.MSP, f"two equal answers to IDENT ({frame.direction.name.lower()})")
            return
        visit.answer = frame
        # Without room for one more, the pending replies must do.
        has_room = self.pending.room(self.speed, now) >= _ANSWER_SIZE
        visit.phase_ends = now + (self._ask(PROBE, _ANSWER_SIZE, now) if has_room else 0.0) + _CONFIRM_S
        visit.ends = max(visit.ends, visit.phase_ends)

    def _mavlink_frame(self, frame: MavlinkFrame, now: float) -> None:
        visit = self._visit
        before, visit.last_mavlink = visit.last_mavlink, frame
        self.pending.heard(self.speed, 0, now)
        if self.found or visit.heartbeat is not None:
            return
        if before is None:
            # On a slow line a Harakiri's stream is torn, and whole frames are rare.
            visit.ends = max(visit.ends, now + _FULL_VISIT_S)
        is_repeated = before is not None and before.sender == frame.sender and frame.compid in _AUTOPILOT_COMPIDS
        if is_repeated or is_autopilot_heartbeat(frame):
            visit.heartbeat = frame
            if not visit.probes and visit.answer is None:
                visit.phase_ends = now
            # MSP may still answer, and a reply that is being confirmed keeps the full time.
            visit.ends = max(now + self._two_probes_s(), visit.phase_ends)

    def _conclude(self, spoken: Spoken, why: str) -> None:
        self.found = Found(spoken, self.speed, why, self._visit.heartbeat, self.pending)
        if self.speed in self.fc_line.good_speeds:
            self.fc_line.good_speeds.remove(self.speed)
        self.fc_line.good_speeds.append(self.speed)
