# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers MSP requests of other programs, from the last replies to the bridge itself or from the flight controller.

A known reply does not use the line, so it is given in flight and during a mission transfer, too. The others are
requested one at a time, for each program in turn, by a disarmed craft only, and between polls. They use the part
of the line that telemetry leaves, unless a mission needs it. A request that cannot be answered yet waits. After 3 s the
program is disconnected, because programs misread MSP's error reply: INAV Configurator mistakes it for success.
"""

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from functools import partial
from math import inf

from bridge.fc.profile import FlightController
from bridge.fc.session import FcSession
from bridge.gcs.budget import Rate, TokenBucket
from bridge.gcs.ground import Ground
from bridge.line.conversation import Conversation, LinkLost, Receive, Send, ask_armed
from bridge.line.msp_link import MspLink
from bridge.missions.mission_service import MissionService
from bridge.model.events import Emit, Level, ShareRefused
from bridge.settings.board_settings import BoardSettings
from bridge.voice import sentences
from protocols.msp.frame import Direction, MspFrame, MspParser, frame_size, is_clean
from protocols.msp.nav import Nav, UnsafeRecord, decode_wp, encode_set_wp
from protocols.rights import Effect
from protocols.rights.msp import MSP_RIGHTS, MspRight, msp_right

#: For this long a reply also answers the same request of other programs.
_CURRENT_S = 0.2
#: An unanswered request occupies the line longer than any other: then programs may not use it for a while.
_PAUSE_AFTER_LOSS_S = 0.5
#: The interval at which waiting requests are checked on an idle line.
_LOOK_AGAIN_S = 0.1
#: Refused changes, and requests without a reply, are reported this often: programs repeat their attempts.
_REPORTS = Rate(1 / 30, 1)
#: SET_RTC and COMMON_SET_TZ: mwp sets an INAV's clock each time it connects, and continues after an error.
_CLOCK = frozenset((247, 0x1002))
_ARMED, _NO_REPLY = "armed", "no reply from the flight controller"
#: mwp asks up to 190 times a second if it is answered at once. More than this is a flood.
_LIMIT = Rate(200, 200)
#: Programs mostly wait for a reply before they ask again.
_MAX_WAITING = 16
#: The part of one read from a connection that is parsed, bytes.
_READ_SIZE = 512
#: A request waits for the line for this long. INAV Configurator repeats an unanswered request after 3 s.
_WAIT_S = 3.0


@dataclass(slots=True, eq=False)
class WaitingRequest:
    """A request that is not answered yet.

    `asked`: the frame that is sent: a low command as v1, which every flight controller speaks. `is_polled`: the bridge
    polls for the same reply. `is_change`: it changes something on the flight controller.
    """

    frame: MspFrame
    until: float
    asked: bytes = field(init=False)
    is_polled: bool = False
    is_change: bool = False

    def __post_init__(self) -> None:
        self.asked = MspFrame(Direction.REQUEST, self.frame.command, self.frame.payload).encode()


@dataclass(eq=False)
class Program:
    """A connected program. `name`: the address, `host`: the part without the port.

    `send` carries a frame to it, `close` ends the connection. `may_write`: it may change something on the flight
    controller.
    """

    name: str
    host: str
    send: Callable[[bytes], None]
    close: Callable[[], None]
    _: KW_ONLY
    may_write: bool
    waiting: list[WaitingRequest] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._parser = MspParser(takes_low_v2=True)
        self._budget = TokenBucket(_LIMIT)

    def take(self, data: bytes, now: float) -> bool:
        """Queue the requests in `data`. Returns False if all were dropped because of a flood."""
        if not self._budget.take(now):
            return False
        requests = [frame for frame in self._parser.feed(data[-_READ_SIZE:]) if frame.direction is Direction.REQUEST]
        self._budget.spend(len(requests) - 1)  # one is counted
        accepted = requests[: _MAX_WAITING - len(self.waiting)]
        self.waiting += [WaitingRequest(frame, now + _WAIT_S) for frame in accepted]
        return True

    def answer(self, waiting: WaitingRequest, reply: MspFrame) -> None:
        self.waiting.remove(waiting)
        self.send(MspFrame(reply.direction, reply.command, reply.payload, waiting.frame.is_v2).encode())


@dataclass(eq=False)
class MspSharing:
    """`refused`: requests that were refused or not answered in time, by reason."""

    _session: FcSession
    _missions: MissionService
    _ground: Ground
    _emit: Emit
    _settings: BoardSettings
    _programs: deque[Program] = field(default_factory=deque)  # the next program to have a request forwarded first
    _forwarded: WaitingRequest | None = None
    #: When the line has carried the last forwarded request and the reply.
    _free_at: float = 0.0
    _stopped: bool = False
    _reports: TokenBucket = field(default_factory=partial(TokenBucket, _REPORTS))
    refused: Counter[str] = field(default_factory=Counter)
    #: The time of the next `tick`, or infinity without waiting requests.
    due: float = inf

    def join(self, program: Program) -> None:
        self._programs.append(program)

    def leave(self, program: Program) -> None:
        if program in self._programs:
            self._programs.remove(program)

    def received(self, program: Program, data: bytes, now: float) -> None:
        if program not in self._programs:
            return
        if not program.take(data, now):
            self.refused["too many requests"] += 1
        elif program.waiting:
            self.tick(now)

    def stop(self) -> None:
        """Stop forwarding: the bridge is stopping."""
        self._stopped = True

    def tick(self, now: float) -> None:
        """Answer what can be answered, disconnect programs that waited too long, and forward the next request."""
        waiting = [program for program in self._programs if program.waiting]
        for program in waiting:
            self._answer(program, now)
            for request in tuple(program.waiting):
                if request.until <= now and request is not self._forwarded:
                    self._drop(program, request, self._obstacle() or _NO_REPLY, now)
        if self._forwarded is None and self._free_at <= now:
            self._forward_next(now)
        deadlines = [request.until for program in self._programs for request in program.waiting if request.until > now]
        again = now + _LOOK_AGAIN_S if self._free_at <= now else min(self._free_at, now + _LOOK_AGAIN_S)
        self._missions.runner.programs_wait = any(program.waiting for program in self._programs)
        self.due = min([again, *deadlines]) if self._missions.runner.programs_wait else inf

    def _answer(self, program: Program, now: float) -> None:
        """Answer or refuse a program's requests, those of the same command in order. A change holds up what follows."""
        link, controller = self._session.state.link, self._session.state.controller
        if link is None or controller is None:
            return
        unanswered = set[int]()
        for request in tuple(program.waiting):
            frame = request.frame
            if request is self._forwarded and request.is_change:
                return
            right = right_of(frame, controller)
            if is_unknown_read(right, frame):
                # As the flight controller itself would reply.
                program.answer(request, MspFrame(Direction.ERROR, frame.command))
                continue
            armed = self._session.vehicle.armed
            why = refusal(request, right, link, may_write=program.may_write, armed=armed)
            if why:
                self._refuse(program, request, why, now)
                if program not in self._programs:
                    return
                continue
            request.is_change = right.effect is Effect.CHANGE
            if request.is_change:
                return
            if frame.command not in unanswered:
                reply = self._known(request, link, now)
                if reply is None:
                    unanswered.add(frame.command)
                else:
                    program.answer(request, reply)

    def _known(self, request: WaitingRequest, link: MspLink, now: float) -> MspFrame | None:
        max_age_s = self._session.polls.follow(request.frame.command, request.asked, now)
        request.is_polled = max_age_s is not None
        if max_age_s == inf:
            return MspFrame(Direction.ERROR, request.frame.command)
        return link.replies.get(request.asked, _CURRENT_S if max_age_s is None else max_age_s, now)

    def _forward_next(self, now: float) -> None:
        """Forward the first request that needs the line, of the program whose turn it is."""
        link, controller = self._session.state.link, self._session.state.controller
        if self._obstacle() or self._missions.runner.is_busy or link is None or controller is None:
            return
        if self._session.polls.due(link) <= now:
            return  # telemetry first
        for program in self._programs:
            request = _first_unknown(program.waiting)
            if request is None or (request.frame.payload and link.owes(request.frame.command)):
                continue
            if request.is_change and self._missions.occupied() is not None:
                continue
            self._programs.remove(program)
            self._programs.append(program)
            self._forward(program, request, controller, now)
            return

    def _obstacle(self) -> str:
        """The reason why requests cannot be forwarded now, or empty if it can."""
        state = self._session.state
        if state.link is None or state.controller is None:
            return "the flight controller does not speak MSP now"
        armed = self._session.vehicle.armed
        if armed is not False:
            return _ARMED if armed else "not yet known to be disarmed"
        if self._stopped:
            return "naze-bridge is stopping"
        return "a mission transfer is running" if self._missions.runner.needs_line else ""

    def _forward(self, program: Program, request: WaitingRequest, controller: FlightController, now: float) -> None:
        self._forwarded = request
        right = right_of(request.frame, controller)

        def done(reply: MspFrame | str | LinkLost, at: float) -> None:
            self._forwarded = None
            size = len(request.asked) + (len(reply.encode()) if isinstance(reply, MspFrame) else 0)
            self._free_at = now + self._session.polls.rest_s(size)
            if not isinstance(reply, MspFrame):
                self._free_at = at + _PAUSE_AFTER_LOSS_S
            if request.is_change:
                self._settings.may_have_changed(at)
                if (link := self._session.state.link) is not None:
                    link.replies.forget()
            if request.is_change and request in program.waiting:
                if isinstance(reply, MspFrame):
                    program.answer(request, reply)
                elif reply == _ARMED:
                    self._refuse(program, request, _ARMED, at)
                else:
                    # It may have been carried out, so it is not repeated.
                    self._drop(program, request, self._obstacle() or _NO_REPLY, at)
            self.tick(at)

        conversation = _carry(request, frame_size(request.frame.command, right.reply), controller.arm_bit)
        self._missions.runner.start(conversation, done, now, in_background=True)

    def _refuse(self, program: Program, request: WaitingRequest, why: str, now: float) -> None:
        if request.frame.command in _CLOCK:
            program.answer(request, MspFrame(Direction.ERROR, request.frame.command))
        elif name := self._drop(program, request, why, now):
            self._ground.say(sentences.PROGRAM_REFUSED(program.host, name, why))

    def _drop(self, program: Program, request: WaitingRequest, why: str, now: float) -> str:
        """End a request without a reply, and the connection. The request's name if pilots may be told."""
        controller = self._session.state.controller
        name = f"command {request.frame.command}" if controller is None else right_of(request.frame, controller).name
        self.refused[why] += 1
        is_reported = self._reports.take(now)
        level: Level = "warning" if is_reported else "debug"
        self._emit(ShareRefused(level=level, program=program.name, command=name, why=why))
        program.waiting.remove(request)
        self._programs.remove(program)
        program.waiting.clear()
        program.close()
        return name if is_reported else ""


def _first_unknown(waiting: list[WaitingRequest]) -> WaitingRequest | None:
    """The first request to forward: a change only when everything before it was answered."""
    for request in waiting:
        if request.is_change:
            return request if request is waiting[0] else None
        if not request.is_polled:
            return request
    return None


def _carry(request: WaitingRequest, reply_size: int, arm_bit: int | None) -> Conversation[MspFrame | str]:
    """Forward a request. The reply, or the reason for none. No poll may have reported yet that the craft was armed."""
    command = request.frame.command
    if request.is_change:
        armed = yield from ask_armed(arm_bit)
        if armed is not False:
            return _ARMED if armed else _NO_REPLY
    is_read = not request.is_change
    asked = Send(request.asked, command, reply_size, exclusive=not is_read, is_kept=is_read)
    reply: MspFrame | None = yield Receive(frozenset((command,)), asked)
    return reply or _NO_REPLY


def right_of(frame: MspFrame, controller: FlightController) -> MspRight:
    return msp_right(controller.firmware, frame.command, frame.payload)


def is_unknown_read(right: MspRight, frame: MspFrame) -> bool:
    """True if this flight controller does not handle a request that on every other firmware at most reads."""
    if right.effect is not Effect.UNKNOWN:
        return False
    elsewhere = [rights[frame.command] for rights in MSP_RIGHTS.values() if frame.command in rights]
    is_read = all(row.effect is Effect.READ for row in elsewhere)
    return is_read and (not frame.payload or any(row.effect_of(frame.payload) is Effect.READ for row in elsewhere))


def refusal(waiting: WaitingRequest, right: MspRight, link: MspLink, *, may_write: bool, armed: bool | None) -> str:
    """The reason why a request is never forwarded, or empty if it may be."""
    if right.effect is Effect.MOVE:
        return "never forwarded"
    if right.effect is Effect.UNKNOWN:
        return "unknown on this board"
    if right.effect is Effect.CHANGE:
        if not may_write:
            return "read-only share"
        if armed:
            return _ARMED
    if not (link.any_byte or is_clean(waiting.asked)):
        return "bytes that open the command line"
    if waiting.frame.command == Nav.SET_WP and (record := decode_wp(waiting.frame.payload)):
        try:
            encode_set_wp(*record)
        except UnsafeRecord:
            return "a record that crashes INAV"
    return ""
