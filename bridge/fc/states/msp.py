# SPDX-License-Identifier: GPL-3.0-or-later
"""The states of an MSP line: the board is being identified, or polled, or in the command line."""

from collections.abc import Sequence

from bridge.fc.msp_telemetry import hear_msp
from bridge.fc.profile import MSP_SILENCE_S, FlightController, Interview, NoAnswer, Profile, Spoken
from bridge.fc.states.base import Event, FcLine, Found, Identified, Lost, State
from bridge.line.conversation import Conversation, LinkLost
from bridge.line.msp_link import FRSKY_SPEED, PROBE, MspLink, PendingReplies
from bridge.voice.sentences import IN_COMMAND_LINE
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter, is_disarmed_heartbeat
from protocols.msp.command_line import RUB_OUT_LINE, typed_and_rubbed_out
from protocols.msp.frame import Direction, MspFrame, MspParser

#: The time without MSP after which foreign bytes mean that the board was armed and sends telemetry. On a slow line a
#: Harakiri's MAVLink is torn: before the change is believed, this many bytes may pass without a whole frame.
_FOREIGN_SILENCE_S = 0.5
_BYTES_BEFORE_CHANGE = 300
_FOREIGN_SIZE = 16
#: Identification must be done by then. On a line at 1200 baud it takes 8 s.
_IDENTIFY_TIMEOUT_S = 15.0
#: The speeds of Harakiri's telemetry while armed (tele_prot 3 and 1).
_ARMED_SPEEDS = (57600, FRSKY_SPEED)
#: A person may be typing into the command line: the bridge is silent until it has been quiet for this long, and then
#: once in this time. Two requests without an echo: the board is restarting, or unpowered.
_QUIET_S, _NO_ECHO_S = 3.0, 7.0


class MspLine(State):
    """A line with MSP replies: the base of `Identifying` and `Polling`."""

    link: MspLink

    def __init__(self, fc_line: FcLine, found: Found, link: MspLink, now: float) -> None:
        super().__init__(fc_line, found, now)
        self.link = link
        self.found = found
        self._foreign = _ForeignBytes(link)
        #: The event that ends this state, once a conversation has found it.
        self._end: Event | None = None
        #: After this long without a reply the board is gone.
        self._longest_silence_s = MSP_SILENCE_S

    @property
    def bad_checksums(self) -> int | None:
        return self.link.parser.bad_checksums

    def receive(self, data: bytes, now: float) -> Event | None:
        frames = self.link.receive(data, now)
        if frames:
            for frame in frames:
                self._take(frame, now)
            self.is_mid_frame = False
            if self.link.parser.skipped_bytes > self._foreign.skipped_before:
                self._foreign = _ForeignBytes(self.link)
            return self._end
        self.is_mid_frame = not self._foreign.size
        self._foreign.note(data)
        echo = self.link.echo
        echo.feed(data)
        if echo.is_echo():
            return Found(Spoken.CLI, self.speed, "it echoes requests that it answered before")
        return self._end

    def tick(self, now: float) -> Event | None:
        """Give up on lost requests, and on a silent board."""
        for frame in self.link.tick(now):
            self._take(frame, now)
        return self._end or self._silence(now)

    def unanswered(self) -> PendingReplies:
        return self.link.unanswered()

    def _take(self, frame: MspFrame, now: float) -> None:
        """A reply belongs to the conversation that waits for it, else to a poll."""
        if frame.command in self.fc_line.runner.awaited_replies:
            self.fc_line.runner.advance(frame, now)
        elif self.controller is not None and frame.command in self.fc_line.polls.commands:
            self.fc_line.polls.answered(frame)
            hear_msp(self.fc_line.vehicle, frame, self.controller, now)

    def _silent_since(self) -> float:
        return self.link.last_heard_at

    def _silence_s(self) -> float:
        if not self._is_foreign():
            return self._longest_silence_s
        return min(_FOREIGN_SILENCE_S + _BYTES_BEFORE_CHANGE * self.link.byte_s, self._longest_silence_s)

    def _is_foreign(self) -> bool:
        """True if more bytes arrived than damaged replies could explain."""
        surplus = self._foreign.size - _FOREIGN_SIZE
        return surplus >= 0 and surplus >= self.link.outstanding_bytes

    def _silence(self, now: float) -> Event | None:
        """Leave MSP when it is no longer answered: for MAVLink if that is heard instead, else to search."""
        since = self._silent_since()
        if now < since + _FOREIGN_SILENCE_S or now < since + self._silence_s():
            return None
        heard = self._foreign.mavlink
        if heard is not None:
            return Found(self.fc_line.mavlink_of(heard), self.speed, "heard where MSP was answered before", heard)
        # At a much lower speed than the telemetry's, the port reads only a few wrong bytes, or none.
        why = "the incoming data is no longer MSP" if self._is_foreign() else f"no answer for {self._silence_s()} s"
        # A board that was armed at the speed of FrSky telemetry has disarmed, and is back at the previous, good speed.
        has_disarmed = self.speed == FRSKY_SPEED and self.fc_line.vehicle.armed
        return Lost(why, () if has_disarmed else _ARMED_SPEEDS, self.unanswered())


class Identifying(MspLine):
    """MSP is answered. The board is being identified."""

    name = "identifying"

    def __init__(self, fc_line: FcLine, event: Found, now: float) -> None:
        owed = event.pending.size(event.speed, now)
        super().__init__(fc_line, event, MspLink(event.speed, fc_line.output, now, owed), now)
        self._give_up_at = now + _IDENTIFY_TIMEOUT_S
        fc_line.runner.link_up(self.link)
        self._task = fc_line.runner.start(_identify(fc_line.profiles), self._identified, now)

    def _identified(self, board: FlightController | LinkLost | None, _now: float) -> None:
        if isinstance(board, FlightController):
            self._end = Identified(board, self.found, self.link)
        else:
            self._end = Lost("fell silent while it was being identified", pending=self.unanswered())

    def tick(self, now: float) -> Event | None:
        event = super().tick(now)
        if event is None and now >= self._give_up_at:
            return Lost(f"not identified within {_IDENTIFY_TIMEOUT_S:.0f} s", pending=self.unanswered())
        return event

    @property
    def due(self) -> float:
        if self._end is not None:
            return 0.0
        return min(self.link.due, self._silent_since() + self._silence_s(), self._give_up_at)

    def _silent_since(self) -> float:
        # The identification may have to wait its turn, behind a conversation that waits for the store.
        began = self._task.began_at
        return self._give_up_at if began is None else max(began, self.link.last_heard_at)


class Polling(MspLine):
    """The flight controller is known and polled over MSP."""

    name = "MSP"
    controller: FlightController

    def __init__(self, fc_line: FcLine, event: Identified, now: float) -> None:
        super().__init__(fc_line, event.found, event.link, now)
        self.controller = controller = event.controller
        self._longest_silence_s = controller.profile.silence_s
        fc_line.met_family = controller.profile.family
        if controller.info is not None:
            self.link.receiver_timeout_s = controller.info.inter_byte_timeout_ms / 1000
        self.link.any_byte = controller.profile.accepts_any_byte
        self.link.turn_s = controller.profile.turn_s
        fc_line.polls.begin(event.found.speed, controller.profile.polls, controller.profile.turn_s)
        fc_line.meet(controller)

    def tick(self, now: float) -> Event | None:
        event = super().tick(now)
        if event is None:
            self.fc_line.polls.ask(self.link, now, beside_missions=self.fc_line.runner.needs_line)
        return event

    @property
    def due(self) -> float:
        if self._end is not None:
            return 0.0
        is_torn = self.link.parser.skipped_bytes > self._foreign.skipped_before
        silent_at = self.link.last_heard_at + (self._silence_s() if is_torn else self._longest_silence_s)
        return min(self.link.due, self.fc_line.polls.due(self.link), silent_at)


class Cli(State):
    """The board was left in the command line, or a terminal program opened it.

    Sends only complete requests without a line end, and DEL, which erases them: so the pilot's `exit` stays intact,
    and none is executed. A reply or a heartbeat shows that it is back.
    """

    name = "command line"
    trouble = IN_COMMAND_LINE()

    def __init__(self, fc_line: FcLine, event: Found, now: float) -> None:
        super().__init__(fc_line, event, now)
        self._heard_at = self._sent_at = now
        self._begin_listening()
        fc_line.output.append(RUB_OUT_LINE)

    def receive(self, data: bytes, now: float) -> Event | None:
        self._heard_at = now
        answers = [frame for frame in self._msp.feed(data) if frame.direction is not Direction.REQUEST]
        return Lost("it has left its command line") if answers or self._mavlink.feed(data) else None

    def tick(self, now: float) -> Event | None:
        if now >= self._heard_at + _NO_ECHO_S:
            return Lost("its command line no longer echoes")
        if now >= self._ask_at:
            self._sent_at = now
            self._begin_listening()
            self.fc_line.output.append(typed_and_rubbed_out(PROBE))
        return None

    @property
    def due(self) -> float:
        return min(self._ask_at, self._heard_at + _NO_ECHO_S)

    @property
    def _ask_at(self) -> float:
        return max(self._heard_at, self._sent_at) + _QUIET_S

    def _begin_listening(self) -> None:
        # An echoed header hides what follows it from the parser.
        self._msp, self._mavlink = MspParser(), MavlinkSplitter()


class _ForeignBytes:
    """Bytes on an MSP line that are not MSP, since the last reply."""

    def __init__(self, link: MspLink) -> None:
        self.mavlink: MavlinkFrame | None = None
        self._parser = link.parser
        self.skipped_before = link.parser.skipped_bytes
        self._splitter = MavlinkSplitter()

    @property
    def size(self) -> int:
        return self._parser.skipped_bytes - self.skipped_before

    def note(self, data: bytes) -> None:
        for frame in self._splitter.feed(data) if self.size else ():
            # A disarmed Harakiri that does not hear a request sends heartbeats, and still answers MSP.
            if not is_disarmed_heartbeat(frame):
                self.mavlink = frame


def _identify(profiles: Sequence[Profile]) -> Conversation[FlightController | None]:
    """Identify the board. Returns None if it left a request unanswered or no profile recognised it."""
    board = Interview()
    try:
        for profile in profiles:
            if profile.recognise is not None:
                controller = yield from profile.recognise(board)
                if controller is not None:
                    return controller
    except NoAnswer:
        pass
    return None
