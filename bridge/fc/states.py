# SPDX-License-Identifier: GPL-3.0-or-later
"""The states of the line to a flight controller, one class each. Sans-IO.

Every state takes bytes and time, reports an event when it ends, and has a deadline: no state can wait for ever.
`bridge.fc.session` holds the table of which event leads where.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import inf
from typing import ClassVar

from bridge.fc.autosense import Autosense, Found, Spoken
from bridge.fc.identify import identify_msp
from bridge.fc.mavlink_telemetry import MavlinkTelemetry
from bridge.fc.msp_telemetry import hear_msp
from bridge.fc.profile import FlightController, Profile
from bridge.line.conversation import LinkLost
from bridge.line.frsky_line import FrskyLine
from bridge.line.mavlink_line import MavlinkLine
from bridge.line.msp_link import MspLink
from bridge.line.pending_replies import PendingReplies
from bridge.line.poll_schedule import PollSchedule
from bridge.line.runner import Runner
from bridge.model.vehicle import FlightState, Source, Vehicle
from protocols.frsky import FRSKY_SPEED
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mavlink.heartbeat import is_disarmed_heartbeat
from protocols.msp.frame import MspFrame

#: A flight controller that answers nothing for this long is gone: unplugged, reset, or switched to another protocol.
MSP_SILENCE_S = 2.0
#: The same while bytes arrive that are not MSP: it was armed, and sends telemetry now.
_FOREIGN_SILENCE_S = 0.5
_FOREIGN_SIZE = 16
#: Identification must be done by then; on a line at 1200 baud it takes 8 s.
_IDENTIFY_TIMEOUT_S = 15.0
#: The speeds of Harakiri's telemetry while armed (tele_prot 3 and 1).
_ARMED_SPEEDS = (57600, FRSKY_SPEED)
#: A board that stores no missions is identified again after this time, then after twice as long, and so on: damaged
#: replies can make a Harakiri look like another board.
_FIRST_CHECK_S = 2.0
_LAST_CHECK_S = 64.0


class Autopilot(Enum):
    """Whose MAVLink is heard on the port."""

    AUTO = "auto"
    HARAKIRI = "harakiri"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class PortOpened:
    """The port is open."""


@dataclass(frozen=True, slots=True)
class PortClosed:
    """The port is gone. `why` is None if the bridge closed it itself."""

    why: str | None


@dataclass(frozen=True, slots=True)
class MspFound:
    """The board answers MSP. `pending`: replies that it may still owe to the search."""

    found: Found
    pending: PendingReplies


@dataclass(frozen=True, slots=True)
class MavlinkFound:
    """MAVLink was heard."""

    found: Found


@dataclass(frozen=True, slots=True)
class FrskyFound:
    """FrSky telemetry was heard."""

    found: Found


@dataclass(frozen=True, slots=True)
class Identified:
    """The board on an MSP link is known."""

    controller: FlightController
    found: Found
    link: MspLink


@dataclass(frozen=True, slots=True)
class Lost:
    """The line fell silent, or carries something else. `first`: speeds to try before all others."""

    why: str
    first: Sequence[int] = ()
    pending: PendingReplies = field(default_factory=PendingReplies)


Event = PortOpened | PortClosed | MspFound | MavlinkFound | FrskyFound | Identified | Lost


@dataclass(slots=True)
class Port:
    """Everything that outlives a state: settings, knowledge about the port, and shared parts of the bridge."""

    speeds: Sequence[int | None]
    autopilot: Autopilot
    profiles: Sequence[Profile]
    runner: Runner
    on_mavlink: Callable[[list[MavlinkFrame]], None]
    polls: PollSchedule = field(default_factory=PollSchedule)
    vehicle: Vehicle = field(default_factory=Vehicle)
    output: list[bytes] = field(default_factory=list)
    #: A Harakiri that arms may change its speed; disarmed, it comes back to this one.
    known_speed: int | None = None
    #: The family of the board that was last identified over MSP on this port.
    met_family: str | None = None
    #: The family of the board that `vehicle` describes, which outlives a lost link and a change of protocol.
    family: str | None = None

    def meet(self, controller: FlightController) -> None:
        """Begin a new vehicle if this is another board than before."""
        if controller.profile.family != self.family:
            self.family, self.vehicle = controller.profile.family, Vehicle()
        self.vehicle.mixer = controller.mixer or self.vehicle.mixer


class State(ABC):
    """One state. `receive` and `tick` return the event that ends it, or None."""

    name: ClassVar[str]
    #: Whether the flight controller is still being looked for.
    is_searching: ClassVar[bool] = False
    controller: FlightController | None = None
    link: MspLink | None = None

    def __init__(self, port: Port, speed: int | None) -> None:
        self.port = port
        self.speed = speed

    @abstractmethod
    def receive(self, data: bytes, now: float) -> Event | None:
        """Take bytes from the port."""

    @abstractmethod
    def tick(self, now: float) -> Event | None:
        """Run the timers."""

    @abstractmethod
    def deadline(self) -> float:
        """The time of the next `tick`; infinity only while the port is closed."""

    def take_output(self) -> list[bytes]:
        """The bytes to be written, in order."""
        output, self.port.output = self.port.output, []
        return output

    def unanswered(self) -> PendingReplies:
        """Replies that may still come: a board that stood still sends them all at once."""
        return PendingReplies()

    @property
    def bad_checksums(self) -> int | None:
        """Damaged frames since the flight controller was found; None if that is not counted."""
        return None


class Closed(State):
    """There is no port."""

    name = "no port"

    def receive(self, data: bytes, now: float) -> Event | None:
        """Bytes that were read before the port closed: dropped."""

    def tick(self, now: float) -> Event | None:
        """Nothing is due."""

    def deadline(self) -> float:
        """Only an open port leads out of here."""
        return inf


class Searching(State):
    """The protocol and speed are looked for."""

    name = "searching"
    is_searching = True

    def __init__(self, port: Port, now: float, lost: Lost | None = None) -> None:
        first, pending = ((), None) if lost is None else (lost.first, lost.pending)
        self._search = Autosense(port.speeds, port.known_speed, now, first, pending)
        super().__init__(port, self._search.speed)

    def receive(self, data: bytes, now: float) -> Event | None:
        """Feed the search."""
        self._search.receive(data, now)
        return self._event()

    def tick(self, now: float) -> Event | None:
        """Move the search on."""
        self._search.tick(now)
        return self._event()

    def deadline(self) -> float:
        """A search always has a next step."""
        deadline = self._search.next_deadline()
        return 0.0 if deadline is None else deadline

    def take_output(self) -> list[bytes]:
        """The search's probes."""
        return super().take_output() + self._search.take_output()

    def _event(self) -> Event | None:
        self.speed = self._search.speed
        found = self._search.found
        if found is None:
            return None
        self.port.output += self._search.take_output()
        if found.spoken is Spoken.MSP or (self.port.known_speed is None and found.spoken is Spoken.MAVLINK):
            self.port.known_speed = found.speed
        if found.spoken is Spoken.MSP:
            return MspFound(found, self._search.pending)
        return MavlinkFound(found) if found.spoken is Spoken.MAVLINK else FrskyFound(found)


class MspLine(State):
    """A line on which MSP is answered: common to identifying and to the time after it."""

    link: MspLink

    def __init__(self, port: Port, link: MspLink, found: Found) -> None:
        super().__init__(port, found.speed)
        self.link = link
        self.found = found
        self._foreign = _Foreign()

    @property
    def bad_checksums(self) -> int | None:
        """As the link counts them."""
        return self.link.bad_checksums

    def receive(self, data: bytes, now: float) -> Event | None:
        """Take replies."""
        frames = self.link.receive(data, now)
        for frame in frames:
            self.take_frame(frame, now)
        self._foreign.note(data, self.link, is_msp=bool(frames))
        return self.finished()

    def tick(self, now: float) -> Event | None:
        """Give up on lost requests, and on a silent board."""
        for frame in self.link.tick(now):
            self.take_frame(frame, now)
        return self.finished() or self._silence(now)

    def deadline(self) -> float:
        """The link's next deadline, or the end of its silence."""
        if self.finished() is not None:
            return 0.0
        link = self.link.next_deadline()
        silent_at = self._silent_since() + self._silence_s
        return silent_at if link is None else min(link, silent_at)

    def take_output(self) -> list[bytes]:
        """The link's requests."""
        return super().take_output() + self.link.take_output()

    def unanswered(self) -> PendingReplies:
        """What the link still waits for."""
        pending = PendingReplies()
        for sent_at, size in self.link.unanswered():
            pending.add(self.speed, size, sent_at)
        return pending

    def take_frame(self, frame: MspFrame, now: float) -> None:
        """Take one reply."""
        self.port.runner.received(frame, now)

    def finished(self) -> Event | None:
        """The event that ends this state, if it has come."""
        return None

    def _silent_since(self) -> float:
        """The time of the last sign of life, or of the first question after it."""
        return self.link.last_heard_at

    @property
    def _silence_s(self) -> float:
        return _FOREIGN_SILENCE_S if self._is_foreign else MSP_SILENCE_S

    @property
    def _is_foreign(self) -> bool:
        """True if more bytes arrived than damaged replies could explain."""
        return self._foreign.size >= self.link.outstanding_bytes + _FOREIGN_SIZE

    def _silence(self, now: float) -> Event | None:
        """Leave MSP when it is not answered any more: for MAVLink if that is heard instead, else to search."""
        if now < self._silent_since() + self._silence_s:
            return None
        heard = self._foreign.mavlink
        if heard is not None:
            return MavlinkFound(Found(Spoken.MAVLINK, self.speed, "heard where MSP was answered before", heard))
        if self._is_foreign:
            first = [speed for speed in _ARMED_SPEEDS if speed in self.port.speeds and speed != self.speed]
            return Lost("the incoming data is no longer MSP", first, self.unanswered())
        return Lost(f"no answer for {MSP_SILENCE_S} s", pending=self.unanswered())


class Identifying(MspLine):
    """MSP is answered; the board is being identified."""

    name = "identifying"
    is_searching = True

    def __init__(self, port: Port, event: MspFound, now: float) -> None:
        found = event.found
        super().__init__(port, MspLink(found.speed, now, event.pending.size(found.speed, now)), found)
        self._end: Event | None = None
        self._give_up_at = now + _IDENTIFY_TIMEOUT_S
        port.runner.link_up(self.link)
        self._task = port.runner.start(identify_msp(port.profiles), self._identified, now)

    def _identified(self, who: FlightController | LinkLost | None, _now: float) -> None:
        if isinstance(who, FlightController):
            self._end = Identified(who, self.found, self.link)
        else:
            self._end = Lost("fell silent while it was being identified", pending=self.unanswered())

    def finished(self) -> Event | None:
        """Set when the identification has ended."""
        return self._end

    def tick(self, now: float) -> Event | None:
        """As on any MSP line, and not for ever."""
        event = super().tick(now)
        if event is None and now >= self._give_up_at:
            return Lost(f"not identified within {_IDENTIFY_TIMEOUT_S:.0f} s", pending=self.unanswered())
        return event

    def deadline(self) -> float:
        """As on any MSP line, and not for ever."""
        return min(super().deadline(), self._give_up_at)

    def _silent_since(self) -> float:
        # The identification may have to wait its turn, behind a conversation that waits for the store.
        began = self._task.began_at
        return self._give_up_at if began is None else max(began, self.link.last_heard_at)


class Msp(MspLine):
    """The flight controller is known and polled over MSP."""

    name = "MSP"
    controller: FlightController

    def __init__(self, port: Port, event: Identified, now: float) -> None:
        super().__init__(port, event.link, event.found)
        self.controller = controller = event.controller
        port.met_family = controller.profile.family
        if controller.info is not None:
            self.link.receiver_timeout_s = controller.info.inter_byte_timeout_ms / 1000
        self.link.any_byte = controller.profile.accepts_any_byte
        port.polls.begin(event.found.speed, controller.profile.polls)
        port.meet(controller)
        self._check_interval_s = _FIRST_CHECK_S
        self._check_at = now + _FIRST_CHECK_S if controller.profile.open_store is None else inf
        self._corrected: FlightController | None = None

    def take_frame(self, frame: MspFrame, now: float) -> None:
        """Replies belong to a conversation, to a poll, or to both."""
        super().take_frame(frame, now)
        self.port.polls.answered(frame)
        hear_msp(self.port.vehicle, frame, self.controller, now)

    def tick(self, now: float) -> Event | None:
        """Poll; check an identity that is in doubt."""
        event = super().tick(now)
        if event is None:
            self.port.polls.ask(self.link, now, beside_missions=self.port.runner.is_busy)
            if now >= self._check_at and not self.port.runner.is_busy:
                self._check_at = inf
                self.port.runner.start(identify_msp(self.port.profiles), self._checked, now)
        return event

    def deadline(self) -> float:
        """The next poll, or the next deadline of any MSP line."""
        poll = self.port.polls.next_deadline(self.link)
        check_at = inf if self.port.runner.is_busy else self._check_at
        return min(super().deadline(), check_at, inf if poll is None else poll)

    def finished(self) -> Event | None:
        """Set when the board turned out to be another one."""
        return None if self._corrected is None else Identified(self._corrected, self.found, self.link)

    def _checked(self, who: FlightController | LinkLost | None, now: float) -> None:
        if isinstance(who, FlightController) and who.profile is not self.controller.profile:
            self._corrected = who
            return
        self._check_interval_s = min(self._check_interval_s * 2, _LAST_CHECK_S)
        self._check_at = now + self._check_interval_s


class Mavlink(State):
    """The flight controller speaks MAVLink: an armed Harakiri, or an autopilot that represents itself."""

    name = "MAVLink"
    controller: FlightController

    def __init__(self, port: Port, event: MavlinkFound, now: float) -> None:
        super().__init__(port, event.found.speed)
        profile = self._profile(event.found.heard)
        self.controller = FlightController(profile, profile.name)
        port.meet(self.controller)
        self._line = MavlinkLine(is_harakiri=not profile.is_passed_through, now=now)
        self.telemetry = MavlinkTelemetry(port.vehicle, is_harakiri=not profile.is_passed_through)
        if not profile.is_passed_through:
            port.runner.mavlink_up(self._line)

    @property
    def bad_checksums(self) -> int | None:
        """As the line counts them."""
        return self._line.bad_frames

    def receive(self, data: bytes, now: float) -> Event | None:
        """Take frames."""
        return self._take(self._line.receive(data, now), now)

    def tick(self, now: float) -> Event | None:
        """Ask a Harakiri for MSP now and then; notice silence."""
        return self._take(self._line.tick(now, is_conversing=self.port.runner.is_busy), now)

    def deadline(self) -> float:
        """The line's next deadline."""
        return self._line.next_deadline()

    def take_output(self) -> list[bytes]:
        """What the line sends, and what ground stations send through it."""
        return super().take_output() + self._line.take_output()

    def _take(self, frames: list[MavlinkFrame], now: float) -> Event | None:
        if frames:
            self.telemetry.take(frames, now)
            self.port.on_mavlink(frames)
        if self.port.runner.is_busy:
            for frame in frames:
                self.port.runner.received_mavlink(frame, now)
        return Lost(self._line.ended) if self._line.ended else None

    def _profile(self, heard: MavlinkFrame | None) -> Profile:
        """A board met over MSP on this port stays in its family; otherwise the sender decides."""
        profiles = [profile for profile in self.port.profiles if profile.spoken is Spoken.MAVLINK]
        ours = [profile for profile in profiles if not profile.is_passed_through]
        (other,) = (profile for profile in profiles if profile.is_passed_through)
        if self.port.autopilot is Autopilot.OTHER:
            return other
        if self.port.autopilot is Autopilot.HARAKIRI:
            return ours[0]
        sender = None if heard is None else (heard.version, heard.sysid, heard.compid)
        known = (p for p in ours if p.family == self.port.met_family or p.mavlink_sender == sender)
        return next(known, other)


class Frsky(State):
    """An armed Harakiri sends FrSky telemetry (tele_prot 1): nothing to read, so its end is waited for."""

    name = "FrSky"
    controller: FlightController

    def __init__(self, port: Port, event: FrskyFound, now: float) -> None:
        super().__init__(port, event.found.speed)
        (profile,) = (profile for profile in port.profiles if profile.spoken is Spoken.FRSKY)
        self.controller = FlightController(profile, profile.name)
        self._line = FrskyLine(now)
        port.meet(self.controller)
        self._note_armed(now)

    def receive(self, data: bytes, now: float) -> Event | None:
        """Watch the line."""
        if self._line.receive(data, now):
            self._note_armed(now)
        return None

    def _note_armed(self, now: float) -> None:
        """Only an armed Harakiri sends FrSky telemetry."""
        known = self.port.vehicle.last(FlightState)
        self.port.vehicle.hear(FlightState(now, Source.FRSKY, True, None if known is None else known.mode))

    def tick(self, now: float) -> Event | None:
        """Notice silence."""
        self._line.tick(now)
        return Lost(self._line.ended) if self._line.ended else None

    def deadline(self) -> float:
        """The end of the line's silence."""
        return self._line.next_deadline()


class _Foreign:
    """Bytes on an MSP line that are not MSP, since the last reply."""

    def __init__(self) -> None:
        self.size = 0
        self.mavlink: MavlinkFrame | None = None
        self._skipped_before = 0
        self._splitter = MavlinkSplitter()

    def note(self, data: bytes, link: MspLink, *, is_msp: bool) -> None:
        """Examine received bytes."""
        skipped, self._skipped_before = link.skipped_bytes - self._skipped_before, link.skipped_bytes
        if is_msp:
            if self.size:
                self.size, self.mavlink, self._splitter = 0, None, MavlinkSplitter()
            return
        self.size += skipped
        if skipped:
            for frame in self._splitter.feed(data):
                # A disarmed Harakiri that hears no request sends heartbeats, and still answers MSP.
                if not is_disarmed_heartbeat(frame):
                    self.mavlink = frame
