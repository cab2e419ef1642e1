"""One flight controller on one port: searched, identified, polled, lost, searched again. Sans-IO."""

from collections.abc import Callable, Sequence
from enum import Enum

from bridge.autosense import PROBE, Autosense, Found, Spoken, is_plausible_heartbeat
from bridge.flight_controller import FlightController, Kind, identify_msp
from bridge.journal import Journal
from bridge.msp_link import MspLink
from bridge.procedure import Send
from bridge.runner import Runner
from bridge.vehicle_state import POLLS, Poll, VehicleState
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.msp.frame import FRAME_OVERHEAD, MspFrame, MspParser

#: A flight controller that answers nothing for so long is gone: unplugged, reset, or switched to another protocol.
MSP_SILENCE_S = 2.0
MAVLINK_SILENCE_S = 2.5
#: In MAVLink mode MSP is asked for now and then: a Harakiri answers it again once it is disarmed.
_MSP_PROBE_INTERVAL_S = 2.0
#: A heartbeat's base_mode: where it is, and its bit for "armed".
_BASE_MODE, _SAFETY_ARMED = 6, 0x80
#: MAVLink version, sysid and compid of a Harakiri (baseflight_mavlink.c).
_HARAKIRI_SENDER = (1, 1, 200)
_POLL_COMMANDS = frozenset(poll.command for poll in POLLS)


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


#: What each state may turn into; anything else is a bug.
_TRANSITIONS: dict[State, frozenset[State]] = {
    State.NO_PORT: frozenset({State.SEARCHING}),
    State.SEARCHING: frozenset({State.IDENTIFYING, State.MAVLINK, State.NO_PORT}),
    State.IDENTIFYING: frozenset({State.MSP, State.SEARCHING, State.NO_PORT}),
    State.MSP: frozenset({State.SEARCHING, State.NO_PORT}),
    State.MAVLINK: frozenset({State.SEARCHING, State.NO_PORT}),
}


class FcSession:
    """Owns the search, the MSP link and the telemetry polls of one port."""

    def __init__(
        self,
        speeds: Sequence[int | None],
        runner: Runner,
        journal: Journal,
        on_change: Callable[[FlightController | None, float], None],
        on_mavlink: Callable[[list[MavlinkFrame]], None],
        autopilot: Autopilot,
    ) -> None:
        self._speeds = speeds
        self._runner = runner
        self._journal = journal
        self._on_change = on_change
        self._on_mavlink = on_mavlink
        self._autopilot = autopilot
        self.state = State.NO_PORT
        self.controller: FlightController | None = None
        self.vehicle = VehicleState()
        self.speed: int | None = speeds[0]
        self._known_speed: int | None = None
        self._met_harakiri = False
        self._search: Autosense | None = None
        self.link: MspLink | None = None
        self._polls_due: dict[int, float] = {}
        self._mavlink = MavlinkSplitter()
        self._msp_probe = MspParser()
        self._heard_at = 0.0
        self._probe_due = 0.0
        self._output: list[bytes] = []

    @property
    def is_searching(self) -> bool:
        """Whether it is not known yet who is there."""
        return self.state in (State.SEARCHING, State.IDENTIFYING)

    def opened(self, now: float) -> None:
        """The port is there."""
        self._begin_search(now, "port opened")

    def closed(self, now: float, why: str) -> None:
        """The port is gone."""
        if self.state is State.NO_PORT:
            return
        self._enter(State.NO_PORT)
        self._drop(now)
        self._search = None
        self._journal("warning", "fc.port_lost", why=why)

    def take_output(self) -> list[bytes]:
        """Return what is to be written to the port at the present `speed`."""
        output, self._output = self._output, []
        if self._search is not None:
            output += self._search.take_output()
        if self.link is not None:
            output += self.link.take_output()
        return output

    def received(self, data: bytes, now: float) -> None:
        """Take bytes from the port."""
        if self._search is not None:
            self._search.receive(data, now)
            self._follow_search(now)
        elif self.link is not None:
            for frame in self.link.receive(data, now):
                self._msp_frame(frame, now)
        elif self.state is State.MAVLINK:
            self._mavlink_data(data, now)

    def tick(self, now: float) -> None:
        """Do what is due."""
        if self._search is not None:
            self._search.tick(now)
            self._follow_search(now)
        if self.link is not None:
            for frame in self.link.tick(now):
                self._msp_frame(frame, now)
        if self.link is not None and self.state is State.MSP:
            self._poll(now)
            if now >= self.link.last_heard_at + MSP_SILENCE_S:
                self._begin_search(now, f"no answer for {MSP_SILENCE_S} s")
        if self.state is State.MAVLINK:
            if now >= self._heard_at + MAVLINK_SILENCE_S:
                self._begin_search(now, f"no MAVLink for {MAVLINK_SILENCE_S} s")
            elif self._may_be_msp() and now >= self._probe_due:
                self._probe_due = now + _MSP_PROBE_INTERVAL_S
                self._output.append(PROBE)

    def next_deadline(self) -> float | None:
        """Return when `tick` has something to do."""
        deadlines: list[float | None] = []
        if self._search is not None:
            deadlines.append(self._search.next_deadline())
        if self.link is not None:
            deadlines.append(self.link.next_deadline())
        if self.state is State.MSP and self.link is not None:
            deadlines.append(self.link.last_heard_at + MSP_SILENCE_S)
            poll = self._next_poll()
            if poll is not None:
                deadlines.append(self._polls_due[poll.command])
        if self.state is State.MAVLINK:
            deadlines.append(self._heard_at + MAVLINK_SILENCE_S)
            if self._may_be_msp():
                deadlines.append(self._probe_due)
        return min((deadline for deadline in deadlines if deadline is not None), default=None)

    def _enter(self, state: State) -> None:
        assert state in _TRANSITIONS[self.state], (self.state, state)
        self.state = state

    def _begin_search(self, now: float, why: str) -> None:
        self._enter(State.SEARCHING)
        was_known = self.controller is not None
        self._drop(now)
        if was_known:
            self._journal("warning", "fc.lost", why=why, speed_baud=self.speed)
        self._search = Autosense(self._speeds, self._known_speed, now)
        self.speed = self._search.speed

    def _drop(self, now: float) -> None:
        """Forget the present flight controller."""
        self.link = None
        self.vehicle = VehicleState()
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
        self._search = None
        self._journal("debug", "fc.sensed", protocol=found.spoken.value, speed_baud=found.speed, why=found.why)
        if found.spoken is Spoken.MSP or self._known_speed is None:
            # A Harakiri that arms may go to another speed for MAVLink; disarmed, it comes back to this one.
            self._known_speed = found.speed
        if found.spoken is Spoken.MSP:
            self._enter(State.IDENTIFYING)
            self.link = MspLink(found.speed, now)
            self._runner.link_up(self.link)
            self._runner.start(identify_msp(), lambda who, at: self._identified(who, found, at), now)
        else:
            self._enter(State.MAVLINK)
            self._heard_at = now
            self._probe_due = now + _MSP_PROBE_INTERVAL_S
            self._mavlink = MavlinkSplitter()
            self._msp_probe = MspParser()
            kind = Kind.HARAKIRI_MAVLINK if self._is_harakiri(found.heard) else Kind.MAVLINK
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
        self._polls_due = {poll.command: now for poll in POLLS}
        self.vehicle.mixer = controller.mixer
        self._welcome(controller, found, now)

    def _welcome(self, controller: FlightController, found: Found, now: float) -> None:
        self.controller = controller
        if found.spoken is Spoken.MSP:
            self._met_harakiri = controller.kind in (Kind.HARAKIRI, Kind.HARAKIRI_MISSIONS)
        self._journal(
            "info",
            "fc.found",
            protocol=found.spoken.value,
            speed_baud=found.speed,
            name=controller.name,
            kind=controller.kind.value,
            why=found.why,
        )
        self._on_change(controller, now)

    def _msp_frame(self, frame: MspFrame, now: float) -> None:
        self._runner.received(frame, now)
        if self.controller is not None:
            self.vehicle.take(frame, self.controller)

    def _next_poll(self) -> Poll | None:
        """Return the poll that is due first, if the link has room for it: one question at a time."""
        assert self.link is not None
        poll = min(POLLS, key=lambda poll: self._polls_due[poll.command])
        if self.link.awaits(_POLL_COMMANDS) or not self.link.may_send(poll.reply_payload + FRAME_OVERHEAD):
            return None
        return poll

    def _poll(self, now: float) -> None:
        assert self.link is not None
        poll = self._next_poll()
        if poll is not None and self._polls_due[poll.command] <= now:
            self._polls_due[poll.command] = now + poll.interval_s
            self.link.send(Send(poll.frame, poll.command, poll.reply_payload + FRAME_OVERHEAD), now)

    def _is_harakiri(self, heard: MavlinkFrame | None) -> bool:
        """Tell a Harakiri from other autopilots: it was met on this port before, or it sends as only it does.

        MAVLink 1 from system 1, component 200: baseflight's children do that; others are component 1.
        """
        if self._autopilot is not Autopilot.AUTO:
            return self._autopilot is Autopilot.HARAKIRI
        sender = None if heard is None else (heard.version, heard.sysid, heard.compid)
        return self._met_harakiri or sender == _HARAKIRI_SENDER

    def _may_be_msp(self) -> bool:
        """Only a Harakiri is asked: to other autopilots goes nothing but what ground stations send."""
        return self.controller is not None and self.controller.kind is Kind.HARAKIRI_MAVLINK

    def _mavlink_data(self, data: bytes, now: float) -> None:
        frames = self._mavlink.feed(data)
        if frames:
            self._heard_at = now
        for frame in frames:
            if frame.msgid == 0 and is_plausible_heartbeat(frame):
                self.vehicle.armed = bool(frame.payload[_BASE_MODE] & _SAFETY_ARMED)
        if frames:
            self._on_mavlink(frames)
        if self._may_be_msp() and self._msp_probe.feed(data):
            self._begin_search(now, "it answers MSP again")

    def send_mavlink(self, frame: bytes) -> None:
        """Pass a ground station's frame on to an autopilot that speaks MAVLink for itself."""
        if self.state is State.MAVLINK:
            self._output.append(frame)
