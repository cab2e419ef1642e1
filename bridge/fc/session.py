# SPDX-License-Identifier: GPL-3.0-or-later
"""One flight controller on one port: searched, identified, polled, lost, searched again. Sans-IO."""

from collections.abc import Callable, Sequence
from enum import Enum

from bridge.fc.autosense import Autosense, Found, Spoken
from bridge.fc.flight_controller import FlightController, Kind, identify_msp
from bridge.line.frsky_line import FrskyLine
from bridge.line.mavlink_line import MavlinkLine
from bridge.line.msp_link import MspLink
from bridge.line.pending_replies import PendingReplies
from bridge.line.poll_schedule import PollSchedule
from bridge.line.runner import Runner
from bridge.model.events import EventLog, Incidents
from bridge.model.vehicle_state import VehicleState
from protocols.frsky import FRSKY_SPEED
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.msp.frame import MspFrame
from protocols.msp.telemetry import HomePoint

#: A flight controller that answers nothing for so long is gone: unplugged, reset, or switched to another protocol.
MSP_SILENCE_S = 2.0
#: The same, if there is something else on the line that is not MSP: it was armed, and sends telemetry now.
_GARBLED_SILENCE_S = 0.5
_GARBLE_SIZE = 16
#: The speeds of Harakiri's telemetry while armed (tele_prot 3 and 1).
_ARMED_SPEEDS = (57600, FRSKY_SPEED)
#: MAVLink version, sysid and compid of a Harakiri (baseflight_mavlink.c).
_HARAKIRI_SENDER = (1, 1, 200)


class Autopilot(Enum):
    """Whose MAVLink it is that is heard on the port: see `is_harakiri`."""

    AUTO = "auto"
    HARAKIRI = "harakiri"
    OTHER = "other"


class State(Enum):
    """Transitions: see `_TRANSITIONS`."""

    NO_PORT = "no port"
    SEARCHING = "searching"
    IDENTIFYING = "identifying"
    MSP = "MSP"
    MAVLINK = "MAVLink"
    FRSKY = "FrSky"


#: What each state may turn into; anything else is a bug.
_TRANSITIONS: dict[State, frozenset[State]] = {
    State.NO_PORT: frozenset({State.SEARCHING}),
    State.SEARCHING: frozenset({State.IDENTIFYING, State.MAVLINK, State.FRSKY, State.NO_PORT}),
    State.IDENTIFYING: frozenset({State.MSP, State.SEARCHING, State.NO_PORT}),
    State.MSP: frozenset({State.SEARCHING, State.MAVLINK, State.NO_PORT}),
    State.MAVLINK: frozenset({State.SEARCHING, State.NO_PORT}),
    State.FRSKY: frozenset({State.SEARCHING, State.NO_PORT}),
}


class FcSession:
    """Owns the search, the MSP link and the telemetry polls of one port."""

    def __init__(
        self,
        speeds: Sequence[int | None],
        runner: Runner,
        log_event: EventLog,
        incidents: Incidents,
        on_change: Callable[[FlightController | None, float], None],
        on_mavlink: Callable[[list[MavlinkFrame]], None],
        on_answer: Callable[[int, float], None],
        autopilot: Autopilot,
    ) -> None:
        self._speeds = speeds
        self._runner = runner
        self._log_event = log_event
        self._incidents = incidents
        #: From the port's opening or a loss until somebody is found.
        self._incident = ""
        self._on_change = on_change
        self._on_mavlink = on_mavlink
        self._on_answer = on_answer
        self._autopilot = autopilot
        self.state = State.NO_PORT
        self.controller: FlightController | None = None
        self.vehicle = VehicleState()
        self.speed: int | None = speeds[0]
        self._known_speed: int | None = None
        self._met_harakiri = False
        self._search: Autosense | None = None
        self.link: MspLink | None = None
        self.polls = PollSchedule()
        self._mavlink: MavlinkLine | None = None
        self._frsky: FrskyLine | None = None
        self._foreign = _Foreign()
        self._output: list[bytes] = []

    @property
    def is_searching(self) -> bool:
        """Whether it is not known yet who is there."""
        return self.state in (State.SEARCHING, State.IDENTIFYING)

    @property
    def bad_checksums(self) -> int | None:
        """Damaged frames since the present flight controller was found; None if that is not known."""
        if self.link is not None:
            return self.link.bad_checksums
        return None if self._mavlink is None else self._mavlink.bad_frames

    def opened(self, now: float) -> None:
        """The port is there."""
        self._begin_search(now, "port opened")

    def closed(self, now: float, why: str | None) -> None:
        """The port is gone; `why` is None if we closed it ourselves, which is no loss."""
        if self.state is State.NO_PORT:
            return
        self._enter(State.NO_PORT)
        self._drop(now)
        self._search = None
        if why is not None:
            self._log_event("warning", "fc.port_lost", why=why, incident=self._follow_incident())

    def take_output(self) -> list[bytes]:
        """Return what is to be written to the port at the present `speed`."""
        output, self._output = self._output, []
        if self._search is not None:
            output += self._search.take_output()
        if self.link is not None:
            output += self.link.take_output()
        if self._mavlink is not None:
            output += self._mavlink.take_output()
        return output

    def received(self, data: bytes, now: float) -> None:
        """Take bytes from the port."""
        if self._search is not None:
            self._search.receive(data, now)
            self._follow_search(now)
        elif self.link is not None:
            frames = self.link.receive(data, now)
            for frame in frames:
                self._msp_frame(frame, now)
            self._foreign.note(data, self.link, is_msp=bool(frames))
        elif self._mavlink is not None:
            self._mavlink_data(self._mavlink, data, now)
        elif self._frsky is not None:
            self._frsky.receive(data, now)

    def tick(self, now: float) -> None:
        """Do what is due."""
        if self._search is not None:
            self._search.tick(now)
            self._follow_search(now)
        if self.link is not None:
            for frame in self.link.tick(now):
                self._msp_frame(frame, now)
        if self.link is not None and self.state is State.MSP:
            self.polls.ask(self.link, now, beside_missions=self._runner.is_busy)
            self._notice_silence(self.link, now)
        if self._mavlink is not None:
            line = self._mavlink
            self._mavlink_frames(line, line.tick(now, is_conversing=self._runner.is_busy), now)
        if self._frsky is not None:
            self._frsky.tick(now)
            if self._frsky.ended:
                self._begin_search(now, self._frsky.ended)

    def next_deadline(self) -> float | None:
        """Return when `tick` has something to do."""
        deadlines: list[float | None] = []
        if self._search is not None:
            deadlines.append(self._search.next_deadline())
        if self.link is not None:
            deadlines.append(self.link.next_deadline())
        if self.state is State.MSP and self.link is not None:
            deadlines.append(self.link.last_heard_at + self._patience_s)
            deadlines.append(self.polls.next_deadline(self.link))
        if self._mavlink is not None:
            deadlines.append(self._mavlink.next_deadline())
        if self._frsky is not None:
            deadlines.append(self._frsky.next_deadline())
        return min((deadline for deadline in deadlines if deadline is not None), default=None)

    def _enter(self, state: State) -> None:
        assert state in _TRANSITIONS[self.state], (self.state, state)
        self.state = state

    @property
    def _patience_s(self) -> float:
        return _GARBLED_SILENCE_S if self._is_garbled else MSP_SILENCE_S

    @property
    def _is_garbled(self) -> bool:
        """Whether more came than the damaged answers to what was asked."""
        asked = self.link.outstanding_bytes if self.link is not None else 0
        return self._foreign.size >= asked + _GARBLE_SIZE

    def _notice_silence(self, link: MspLink, now: float) -> None:
        """Leave MSP when it is not answered any more: for MAVLink if that is what came instead, else to search."""
        if now < link.last_heard_at + self._patience_s:
            return
        heard = self._foreign.mavlink
        if heard is not None:
            self._drop(now)
            self._take_up_mavlink(Found(Spoken.MAVLINK, self.speed, "heard where MSP was answered before", heard), now)
        elif self._is_garbled:
            first = [speed for speed in _ARMED_SPEEDS if speed in self._speeds and speed != self.speed]
            self._begin_search(now, "what comes is no MSP any more", first)
        else:
            self._begin_search(now, f"no answer for {MSP_SILENCE_S} s")

    def _begin_search(self, now: float, why: str, first: Sequence[int] = ()) -> None:
        self._enter(State.SEARCHING)
        was_known = self.controller is not None
        pending = PendingReplies()
        if self.link is not None:
            for sent_at, size in self.link.unanswered():
                pending.add(self.speed, size, sent_at)
        self._drop(now)
        if was_known:
            self._log_event("warning", "fc.lost", why=why, speed_baud=self.speed, incident=self._follow_incident())
        self._search = Autosense(self._speeds, self._known_speed, now, first, pending)
        self.speed = self._search.speed

    def _follow_incident(self) -> str:
        self._incident = self._incident or self._incidents.begin("link")
        return self._incident

    def _drop(self, now: float) -> None:
        """Forget the present flight controller."""
        self.link = None
        self._mavlink = None
        self._frsky = None
        self._foreign = _Foreign()
        # These stay the same whatever it speaks now.
        before = self.vehicle
        home = before.home_or_position()
        self.vehicle = VehicleState(mixer=before.mixer, home=None if home is None else HomePoint(*home))
        self._runner.link_down(now)
        if self.controller is not None:
            self.controller = None
            self._on_change(None, now)

    def _follow_search(self, now: float) -> None:
        assert self._search is not None
        self.speed = self._search.speed
        found = self._search.found
        if found is None:
            return
        self._output += self._search.take_output()
        pending, self._search = self._search.pending, None
        self._log_event(
            "debug",
            "fc.sensed",
            protocol=found.spoken.value,
            speed_baud=found.speed,
            why=found.why,
            incident=self._follow_incident(),
        )
        if found.spoken is Spoken.MSP or (self._known_speed is None and found.spoken is Spoken.MAVLINK):
            # A Harakiri that arms may go to another speed for MAVLink; disarmed, it comes back to this one.
            self._known_speed = found.speed
        if found.spoken is Spoken.MSP:
            self._enter(State.IDENTIFYING)
            self.link = MspLink(found.speed, now, pending.size(found.speed, now))
            self._runner.link_up(self.link)
            self._runner.start(identify_msp(), lambda who, at: self._identified(who, found, at), now)
        elif found.spoken is Spoken.MAVLINK:
            self._take_up_mavlink(found, now)
        else:
            self._enter(State.FRSKY)
            self._frsky = FrskyLine(now)
            # Only an armed Harakiri sends it.
            self.vehicle.armed = True
            self._welcome(FlightController(Kind.FRSKY, Kind.FRSKY.value), found, now)

    def _take_up_mavlink(self, found: Found, now: float) -> None:
        self._enter(State.MAVLINK)
        is_harakiri = self._is_harakiri(found.heard)
        self._mavlink = MavlinkLine(is_harakiri=is_harakiri, now=now)
        if is_harakiri:
            self._runner.mavlink_up(self._mavlink)
        kind = Kind.HARAKIRI_MAVLINK if is_harakiri else Kind.MAVLINK
        self._welcome(FlightController(kind, kind.value), found, now)

    def _identified(self, controller: FlightController | None, found: Found, now: float) -> None:
        if self.state is not State.IDENTIFYING or self.link is None:
            return
        if controller is None:
            self._begin_search(now, "fell silent while it was asked who it is")
            return
        self._enter(State.MSP)
        if controller.info is not None:
            self.link.receiver_timeout_s = controller.info.inter_byte_timeout_ms / 1000
        self.link.any_byte = controller.navigates
        self.polls.begin(found.speed, navigates=controller.navigates)
        self.vehicle.mixer = controller.mixer
        self._welcome(controller, found, now)

    def _welcome(self, controller: FlightController, found: Found, now: float) -> None:
        self.controller = controller
        if found.spoken is Spoken.MSP:
            self._met_harakiri = controller.kind in (Kind.HARAKIRI, Kind.HARAKIRI_MISSIONS)
        self._log_event(
            "info",
            "fc.found",
            protocol=found.spoken.value,
            speed_baud=found.speed,
            name=controller.name,
            kind=controller.kind.value,
            why=found.why,
            incident=self._follow_incident(),
        )
        self._incident = ""
        self._on_change(controller, now)

    def _msp_frame(self, frame: MspFrame, now: float) -> None:
        self._runner.received(frame, now)
        if self.controller is not None:
            self.polls.answered(frame)
            self.vehicle.take(frame, self.controller)
            self._on_answer(frame.command, now)

    def _is_harakiri(self, heard: MavlinkFrame | None) -> bool:
        """Tell a Harakiri from other autopilots: it was met on this port before, or it sends as only it does.

        MAVLink 1 from system 1, component 200: baseflight's children do that; others are component 1.
        """
        if self._autopilot is not Autopilot.AUTO:
            return self._autopilot is Autopilot.HARAKIRI
        sender = None if heard is None else (heard.version, heard.sysid, heard.compid)
        return self._met_harakiri or sender == _HARAKIRI_SENDER

    def _mavlink_data(self, line: MavlinkLine, data: bytes, now: float) -> None:
        self._mavlink_frames(line, line.receive(data, now), now)

    def _mavlink_frames(self, line: MavlinkLine, frames: list[MavlinkFrame], now: float) -> None:
        self.vehicle.armed = line.armed
        if frames:
            self._on_mavlink(frames)
        if self._runner.is_busy:
            for frame in frames:
                self._runner.received_mavlink(frame, now)
        if line.ended and self.state is State.MAVLINK:
            self._begin_search(now, line.ended)

    def send_mavlink(self, frame: bytes) -> None:
        """Pass a ground station's frame on to an autopilot that speaks MAVLink for itself."""
        if self.state is State.MAVLINK:
            self._output.append(frame)


class _Foreign:
    """What comes on an MSP line that is no MSP, since the last answer."""

    def __init__(self) -> None:
        self.size = 0
        self.mavlink: MavlinkFrame | None = None
        self._skipped_before = 0
        self._splitter = MavlinkSplitter()

    def note(self, data: bytes, link: MspLink, *, is_msp: bool) -> None:
        """Look at what was just received."""
        skipped, self._skipped_before = link.skipped_bytes - self._skipped_before, link.skipped_bytes
        if is_msp:
            if self.size:
                self.size, self.mavlink, self._splitter = 0, None, MavlinkSplitter()
            return
        self.size += skipped
        if skipped:
            for frame in self._splitter.feed(data):
                self.mavlink = frame
