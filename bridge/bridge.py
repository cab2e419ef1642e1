# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge as a whole: one flight controller on one side, ground stations on the other. Sans-IO.

The service feeds in bytes, time and the store's answers, and then takes the output for lines, links and the store.
The path of a byte from the UART:
    fc_received -> FcSession -> MspLink -> Vehicle -> OwnVehicle -> Ground -> take_datagrams
The path of a mission item to the flight controller, and back for verification:
    gcs_received -> Incoming -> GroundStation -> MessageRouter -> MissionUploads -> ListCheck
        -> MissionService.deliver -> FcMissionStore.push -> MspLink
An autopilot that speaks MAVLink itself is not represented but passed through, both ways:
    FcSession <-> Routes <-> Ground
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import count
from math import inf
from typing import Protocol

from bridge.config import BridgeConfig, PassThroughRule
from bridge.fc.actions import FcActions
from bridge.fc.profile import FlightController, RuleSettings, Spoken
from bridge.fc.session import FcSession
from bridge.gcs.ground import FrameListener, Ground
from bridge.gcs.ground_station import GroundStation
from bridge.gcs.guard import Guard
from bridge.gcs.rights import LinkAccess
from bridge.gcs.routes import Routes
from bridge.gcs.station import Peer, Severity
from bridge.line.conversation import StoreEffect
from bridge.line.msp_link import RoundTrips
from bridge.line.runner import Runner
from bridge.missions.mission_service import NO_LINK, EndingListener, HeldMission, MissionService, MissionTransfer
from bridge.model.events import Armed, Disarmed, Emit
from bridge.model.refusal import ARMED, Refusal
from bridge.model.settings import SettingsState
from bridge.model.vehicle import FlightState, Health, MissionLeg, Readiness
from bridge.model.vehicle_groups import Group
from bridge.sharing.msp_sharing import MspSharing
from bridge.sharing.program import Program
from bridge.transfers.downloads import MissionDownloads
from bridge.transfers.local_missions import LocalMissions
from bridge.transfers.mission_watch import MissionWatch
from bridge.transfers.uploads import FC_LOST, STOPPED, MissionUploads
from bridge.vehicle.calibration import Calibration
from bridge.vehicle.commands import CommandService
from bridge.vehicle.incoming import Incoming
from bridge.vehicle.link_announcer import LinkAnnouncer
from bridge.vehicle.message_router import MessageRouter
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.vehicle.parameters import Parameters
from bridge.vehicle.settings_seal import SettingsSeal
from bridge.vehicle.vehicle_report import VehicleReporter
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionResult


@dataclass(frozen=True, slots=True)
class Counters:
    """Since the start; those of the flight controller since it was found, None without MSP."""

    ground_stations: int
    #: Frames of ground stations, by link and message id; damaged ones; refused ones, by link and reason.
    frames_received: Mapping[tuple[str, int], int]
    bad_frames: int
    refused: Mapping[tuple[str, str], int]
    #: Requests of programs on a share, by reason.
    refused_by_share: Mapping[str, int]
    fc_bad_checksums: int
    fc_requests_lost: int | None
    fc_round_trips: RoundTrips | None
    firmware_version: tuple[int, int, int] | None
    settings: SettingsState | None


class TimedPart(Protocol):
    """A part with a timer: `tick` is called at `due` or later, and sets the next `due`; infinity: nothing is due."""

    @property
    def due(self) -> float:
        """Monotonic s."""

    def tick(self, now: float) -> None:
        """Do what is due."""


class Bridge:
    """Wires the parts and routes events between them."""

    def __init__(
        self,
        config: BridgeConfig,
        emit: Emit,
        now: float,
        on_frames: FrameListener | None = None,
        on_ending: EndingListener = lambda _mission, _delivery: None,
    ) -> None:
        self._config, owner = config, config.settings
        self._emit = emit
        self._was_armed = False
        #: True if `take_fc_output` must be called even without `fc_output`.
        self.has_line_changed = True
        self._line_due = now  # of the line itself, as of the last `take_fc_output`
        #: The armed craft, for the BridgeConfig of a restarted bridge; it changes rarely. None: it is not armed.
        self.flight = config.flight
        #: True while an autopilot speaks MAVLink itself: the bridge then sends nothing in its name.
        self.is_passing_through = False
        self._announcer = LinkAnnouncer(
            self._say, lambda: self.session.state.trouble, now, was_found=self.flight is not None
        )
        incidents = count(1)

        passes_everything = owner.pass_through is PassThroughRule.EVERYTHING
        self.ground = Ground(
            owner.sysid,
            config.compid,
            emit,
            self._newcomer,
            on_frames,
            {name: replace(access, passes_everything=passes_everything) for name, access in config.links.items()},
            LinkAccess(passes_everything=passes_everything),
        )
        self.guard = Guard(emit)
        self.runner = Runner()
        self.session = FcSession(
            config.speeds,
            config.profiles,
            self.runner,
            emit,
            incidents,
            self._controller_changed,
            self._mavlink_received,
            owner.autopilot,
            config.flight,
        )
        #: Its readings, which are kept when it is lost.
        self.vehicle = self.session.vehicle
        #: The requests to the flight controller that were not taken yet.
        self.fc_output = self.session.output
        self.missions = MissionService(self.vehicle, self.runner, on_ending)
        self.local = LocalMissions(self.missions, self.ground, emit, incidents)
        self.sharing = MspSharing(self.session, self.runner, self.missions, emit, self._say_refused)
        self._vehicle = OwnVehicle(self.session, self.missions, self.ground, self._announcer, config.unix_time_s, now)
        #: The seal of the flight controller's settings.
        self.settings = SettingsSeal(
            self.session, self.missions, self.ground, emit, config.seals, lambda: self.transfer is not None
        )
        self.sharing.on_change = self.settings.changed_here
        self._reporter = VehicleReporter(
            self.session, self.missions, self.ground, self.settings, self._vehicle.also_want
        )
        self._uploads = MissionUploads(self.missions, self.ground, emit, incidents, self._vehicle.let_read)
        self._watch = MissionWatch(self.missions, self.ground, emit)
        downloads = MissionDownloads(self.missions, self.ground)
        self._parameters = Parameters(self.missions, self.ground, owner.sysid)
        actions = FcActions(self.session, self.missions, self.runner)
        self._calibration = Calibration(self.ground, self.runner, self._announcer)
        commands = CommandService(self.ground, self._vehicle, actions, self.session, self._calibration, config.version)
        router = MessageRouter(self.ground, self._uploads, downloads, self._parameters, commands, self._vehicle)
        self._incoming = Incoming(
            self.guard,
            self.ground,
            router,
            self._parameters,
            self.session.send_mavlink,
            owner.sysid,
            config.compid,
        )
        #: Served in this order, after the line itself.
        self._parts: tuple[TimedPart, ...] = (
            self.runner,
            self.sharing,
            self._uploads,
            self._watch,
            self.settings,
            self.ground,
            self._announcer,
            self._calibration,
            self._vehicle,
        )

        # The front door: calls that one part answers.
        self.take_datagrams = self.ground.take_datagrams
        self.displaced = self.ground.displaced
        self.add_default_peer, self.remove_default_peer = self.ground.add_default_peer, self.ground.remove_default_peer
        self.program_joined, self.program_left = self.sharing.join, self.sharing.leave
        #: Requests of the command line, the page and zenoh.
        self.push, self.pull, self.check = self.local.push, self.local.pull, self.local.check
        #: The store's work, in order.
        self.store_effects = self.runner.store_effects
        self.report, self.group = self._reporter.whole, self._reporter.group
        self.take_fresh = self._reporter.take_fresh

    # The flight controller's side.

    def fc_opened(self, now: float) -> None:
        self.has_line_changed = True
        self.session.opened(now)

    def fc_closed(self, now: float, why: str | None) -> None:
        """The port is gone; `why` is None if the bridge closed it itself."""
        self.has_line_changed = True
        self.session.closed(now, why)

    def fc_received(self, data: bytes, now: float) -> bool:
        """Handle bytes from the port; False if they ended inside a frame and nothing else has changed."""
        self.has_line_changed = True
        self.session.received(data, now)
        self._follow_line(now)
        return not self.session.state.is_mid_frame

    def take_fc_output(self) -> list[bytes]:
        """The bytes to be written to the port at `fc_speed`. Sets when the line itself is due again."""
        self.has_line_changed = False
        self._line_due = self.session.state.due
        output = [*self.fc_output]
        self.fc_output.clear()
        return output

    @property
    def fc_speed(self) -> int | None:
        """The speed that the port must have, baud; None where it has none."""
        return self.session.state.speed

    @property
    def fc_trouble(self) -> str:
        """Why the board cannot be used and what the pilot must do; empty if nothing."""
        return self.session.state.trouble

    @property
    def is_searching(self) -> bool:
        """True while a port is open and the flight controller is not identified yet."""
        return self.session.state.is_searching

    # The ground stations' side.

    def gcs_received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> bool:
        """Handle bytes from a ground station; False if they are dropped. A datagram holds whole frames only."""
        return self._incoming.received(peer, data, now, datagram=datagram)

    def gcs_gone(self, peer: Peer, now: float) -> None:
        self._uploads.peer_gone(peer, now)
        self.ground.gone(peer)

    def link_closed(self, name: str, now: float) -> None:
        """A link is closed, and all ground stations on it are gone."""
        for peer in self.ground.remove_link(name):
            self._uploads.peer_gone(peer, now)

    def notify(self, text: str) -> None:
        """Show a text to each ground station that connects from now on."""
        self.ground.notices.append(text)

    # Other programs, on a share.

    def program_received(self, program: Program, data: bytes, now: float) -> None:
        self.has_line_changed = True
        self.sharing.received(program, data, now)

    # Missions.

    @property
    def held(self) -> HeldMission | None:
        """The flight controller's mission, as last read."""
        return self.missions.held

    @property
    def others(self) -> tuple[HeldMission, ...]:
        return self.missions.others

    @property
    def transfer(self) -> MissionTransfer | None:
        """The mission being received or written."""
        return self.missions.writing or self._uploads.receiving

    def stop_missions(self, now: float) -> None:
        """Accept no more transfers. An upload that still receives items ends; a running push continues."""
        self.missions.close()
        self.sharing.stop()
        self._uploads.end(STOPPED, now)

    # For metrics, the status and other followers.

    def watch(self, groups: Iterable[Group]) -> None:
        """Poll for these groups from now on; `take_fresh` returns the updated ones."""
        self.has_line_changed = True
        self._reporter.watch(groups)

    def counters(self) -> Counters:
        state = self.session.state
        return Counters(
            ground_stations=len(self.ground.peers()),
            frames_received=self.ground.frames_received,
            bad_frames=self.ground.bad_frames,
            refused=self.guard.refused,
            refused_by_share=self.sharing.refused,
            fc_bad_checksums=state.bad_checksums or 0,
            fc_requests_lost=None if state.link is None else state.link.requests_lost,
            fc_round_trips=None if state.link is None else state.link.round_trips,
            firmware_version=self.vehicle.version,
            settings=self.settings.state,
        )

    # Time.

    @property
    def is_busy(self) -> bool:
        """True while a conversation with the flight controller runs or waits."""
        return self.runner.is_busy

    def restart(self, why: str, now: float) -> None:
        """Recover from a bug: end the running conversation and search for the flight controller again."""
        self.has_line_changed = True
        self.runner.reset(now)
        self.session.restart(why, now)

    def abort(self, now: float) -> None:
        """End the running conversation cleanly."""
        self.has_line_changed = True
        self.runner.stop(now)

    def store_answered(self, effect: StoreEffect, answer: object, now: float) -> None:
        self.has_line_changed = True
        self.runner.store_answered(effect, answer, now)

    @property
    def due(self) -> float:
        """The time of the next `tick`."""
        due = self._line_due
        for part in self._parts:  # a loop: this is asked after every reply
            if (part_due := part.due) < due:
                due = part_due
        return due

    def tick(self, now: float) -> None:
        self.has_line_changed = True
        self.session.tick(now)
        for part in self._parts:
            if now >= part.due:
                part.tick(now)
        self._follow_line(now)

    # Between the parts.

    def _say(self, severity: Severity, text: str) -> None:
        if not self.is_passing_through:
            self.ground.say(severity, text)

    def _say_refused(self, text: str) -> None:
        """A program's request was refused. In flight a warning would cover what concerns the craft."""
        self.ground.say(Severity.NOTICE if self.vehicle.armed else Severity.WARNING, text)

    def _newcomer(self, station: GroundStation, now: float) -> None:
        if not self.is_passing_through:
            self._vehicle.newcomer(station, now)

    def _controller_changed(self, controller: FlightController | None, now: float) -> None:
        self.is_passing_through = controller is not None and controller.profile.spoken is Spoken.OTHER_MAVLINK
        self._incoming.routes = Routes(self.ground) if self.is_passing_through else None
        # A passed-through autopilot represents itself.
        self._vehicle.due = inf if self.is_passing_through else min(self._vehicle.due, now)
        self.settings.found(controller, now)
        if controller is None:
            trouble = self.session.state.trouble
            self.missions.use(Refusal(MissionResult.DENIED, trouble) if trouble else NO_LINK, now, is_same_board=True)
            self._uploads.end(FC_LOST, now)
            self._announcer.lost(now if self.vehicle.heard_at is None else self.vehicle.heard_at)
            return
        missions = controller.profile.missions
        rules = RuleSettings(self._config.settings.takeoff_max_m)
        store = missions if isinstance(missions, Refusal) else missions(controller, self.vehicle, rules)
        # On a port that was opened since, an armed board may be another one.
        self.missions.use(store, now, is_same_board=self.session.met_family == controller.profile.family)
        self._announcer.found(controller, now)
        self._calibration.controller_found(now)
        if not isinstance(store, Refusal):
            # Read its list at once: MISSION_CURRENT reports the count, and the first Read needs no wait.
            self._watch.due = now

    def _mavlink_received(self, frames: list[MavlinkFrame]) -> None:
        if self._incoming.routes is not None:
            self._incoming.routes.from_autopilot(frames)

    def _follow_line(self, now: float) -> None:
        """Pass on new readings, and serve programs, which may use the line when no poll is due."""
        is_watched = self._reporter.watched
        if is_watched:
            self.session.settle_telemetry()
        if self.vehicle.news:
            news, self.vehicle.news = self.vehicle.news, set()
            if is_watched:
                self._reporter.heard(news, now)
            if not self.is_passing_through:
                self._vehicle.heard(news, now)
                if Health in news or Readiness in news:
                    self._parameters.follow()
            if MissionLeg in news and (leg := self.vehicle.last(MissionLeg)) is not None:
                self.missions.follow(leg.status)
            if FlightState in news:
                self._follow_arming(now)
                self._remember_flight(now)
        if self.sharing.due < inf:
            self.sharing.tick(now)

    def _remember_flight(self, now: float) -> None:
        if self.vehicle.armed is None or self.is_passing_through:
            return
        before, memory = self.flight, self.session.flight_memory(now)
        if before is None or memory is None or replace(memory, made_at=before.made_at, mode=before.mode) != before:
            self.flight = memory

    def _follow_arming(self, now: float) -> None:
        armed = self.vehicle.armed
        if armed is None or armed == self._was_armed:
            # Unknown is not a change: a Harakiri that arms may fall silent first.
            return
        self._was_armed = armed
        if armed and self._uploads.due < inf:
            self._uploads.end(ARMED, now)
        if armed:
            self.settings.armed()
        self.ground.record_flight(on=armed and not self.is_passing_through)
        self._emit(Armed() if armed else Disarmed())
