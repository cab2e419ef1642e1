# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge as a whole: one flight controller on one side, ground stations on the other. Sans-IO.

The service feeds in bytes, time and the store's answers, and then takes the output for lines, links and the store.
The path of a byte from the UART:
    fc_received -> FcSession -> MspLink -> Vehicle -> OwnVehicle -> Ground -> take_datagrams
The path of a mission item to the flight controller, and back for verification:
    gcs_received -> Ground -> Guard -> MessageRouter -> MissionUploads -> ListCheck
        -> MissionService.deliver -> FcMissionStore.push -> MspLink
An autopilot that speaks MAVLink itself is not represented but passed through, both ways:
    FcSession <-> Routes <-> Ground
"""

from dataclasses import replace
from itertools import count
from math import inf

from bridge.config import BridgeConfig, PassThroughRule
from bridge.fc.actions import FcActions
from bridge.fc.profile import FlightController, RuleSettings, Spoken
from bridge.fc.session import FcSession
from bridge.gcs.ground import FrameListener, Ground
from bridge.gcs.guard import Guard
from bridge.gcs.routes import Routes
from bridge.gcs.station import Peer, Severity
from bridge.line.runner import Runner
from bridge.missions.mission_service import NO_LINK, EndingListener, MissionService, MissionTransfer
from bridge.model.events import Armed, Disarmed, Emit
from bridge.model.refusal import ARMED, Refusal
from bridge.model.vehicle import FlightState, Health, MissionLeg, Readiness
from bridge.sharing.msp_sharing import MspSharing
from bridge.transfers.downloads import MissionDownloads
from bridge.transfers.local_missions import LocalMissions
from bridge.transfers.mission_watch import MissionWatch
from bridge.transfers.uploads import FC_LOST, STOPPED, MissionUploads
from bridge.vehicle.calibration import Calibration
from bridge.vehicle.commands import CommandService
from bridge.vehicle.link_announcer import LinkAnnouncer
from bridge.vehicle.message_router import Incoming, MessageRouter
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.vehicle.parameters import Parameters
from bridge.vehicle.settings_seal import SettingsSeal
from bridge.vehicle.vehicle_report import VehicleReporter
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionResult


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
        #: True while an autopilot speaks MAVLink itself: the bridge then sends nothing in its name.
        self.is_passing_through = False
        #: The armed craft, for the BridgeConfig of a restarted bridge; it changes rarely. None: it is not armed.
        self.flight = config.flight
        self._announcer = LinkAnnouncer(now, was_found=self.flight is not None)
        incidents = count(1)

        self.guard = Guard(config.links, emit, passes_everything=owner.pass_through is PassThroughRule.EVERYTHING)
        self.ground = Ground(
            owner.sysid,
            config.compid,
            emit,
            self._newcomer,
            on_frames,
            self.guard.standing,
            self.guard.signers,
        )
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
        self.missions = MissionService(self.session.vehicle, self.runner, on_ending)
        self.local = LocalMissions(self.missions, self.ground, emit, incidents)
        self.sharing = MspSharing(self.session, self.runner, self.missions, emit, self._say_refused)
        self._vehicle = OwnVehicle(self.session, self.missions, self.ground, self._announcer, config.unix_time_s, now)
        #: The seal of the flight controller's settings.
        self.settings = SettingsSeal(
            self.session, self.missions, self.ground, emit, config.seals, lambda: self.transfer is not None
        )
        self.sharing.on_change = self.settings.changed_here
        self.report = VehicleReporter(self.session, self.missions, self.ground, self.settings, self._vehicle.also_want)
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

    # The flight controller's side.

    def fc_received(self, data: bytes, now: float) -> None:
        self.session.received(data, now)
        self._pass_on_news(now)
        if self.sharing.due < inf:
            self.sharing.serve(now)

    def take_fc_output(self) -> list[bytes]:
        """The bytes to be written to the port at the current `session.state.speed`."""
        return self.session.take_output()

    # The ground stations' side.

    def gcs_received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> bool:
        """Handle bytes from a ground station; False if they are dropped. A datagram holds whole frames only."""
        return self._incoming.received(peer, data, now, datagram=datagram)

    def gcs_gone(self, peer: Peer, now: float) -> None:
        self._forget(peer, now)
        self.ground.gone(peer)

    def link_closed(self, name: str, now: float) -> None:
        """A link is closed, and all ground stations on it are gone."""
        for peer in self.ground.remove_link(name):
            self._forget(peer, now)

    def _forget(self, peer: Peer, now: float) -> None:
        self._uploads.peer_gone(peer, now)
        self._incoming.forget(peer)

    # Missions.

    @property
    def transfer(self) -> MissionTransfer | None:
        """The mission being received or written."""
        return self.missions.writing or self._uploads.receiving

    def stop_missions(self, now: float) -> None:
        """Accept no more transfers. An upload that still receives items ends; a running push continues."""
        self.missions.close()
        self.sharing.stop()
        self._uploads.end(STOPPED, now)

    # Time.

    def restart(self, why: str, now: float) -> None:
        """Recover from a bug: end the running conversation and search for the flight controller again."""
        self.runner.reset(now)
        self.session.restart(why, now)

    def tick(self, now: float) -> None:
        self.ground.now = now
        self.session.tick(now)
        self._pass_on_news(now)
        self.runner.tick(now)
        if self.sharing.due < inf:
            self.sharing.serve(now)
        if now >= self._uploads.due:
            self._uploads.tick(now)
        if now >= self._watch.due:
            self._watch.tick(now)
        if now >= self.settings.due:
            self.settings.tick(now)
        if now >= self.ground.stations.due:
            for peer in self.ground.expire(now):
                self._incoming.forget(peer)
        if now >= self._announcer.due:
            self._say(self._announcer.tick(now, self.session.state.trouble))
        if now >= self._calibration.due:
            self._calibration.tick(now)
        if now >= self._vehicle.due and not self.is_passing_through:
            self._vehicle.tick(now)

    def next_deadline(self) -> float:
        return min(
            self.session.state.deadline(),
            self.runner.due,
            self.sharing.due,
            self._uploads.due,
            self.ground.stations.due,
            self._announcer.due,
            self._calibration.due,
            self._watch.due,
            self.settings.due,
            inf if self.is_passing_through else self._vehicle.due,
        )

    # Between the parts.

    def _say(self, news: tuple[Severity, str] | None) -> None:
        if news is not None and not self.is_passing_through:
            self.ground.say(*news)

    def _say_refused(self, text: str) -> None:
        """A program's request was refused. In flight a warning would cover what concerns the craft."""
        self.ground.say(Severity.NOTICE if self.session.vehicle.armed else Severity.WARNING, text)

    def _newcomer(self, peer: Peer) -> None:
        if not self.is_passing_through:
            self._vehicle.newcomer(peer)

    def _controller_changed(self, controller: FlightController | None, now: float) -> None:
        vehicle = self.session.vehicle
        self.is_passing_through = controller is not None and controller.profile.spoken is Spoken.OTHER_MAVLINK
        self._incoming.routes = Routes(self.ground) if self.is_passing_through else None
        self.settings.found(controller, now)
        if controller is None:
            trouble = self.session.state.trouble
            self.missions.use(Refusal(MissionResult.DENIED, trouble) if trouble else NO_LINK, now, is_same_board=True)
            self._uploads.end(FC_LOST, now)
            self._announcer.lost(now if vehicle.heard_at is None else vehicle.heard_at)
            return
        missions = controller.profile.missions
        rules = RuleSettings(self._config.settings.takeoff_max_m)
        store = missions if isinstance(missions, Refusal) else missions(controller, vehicle, rules)
        # On a port that was opened since, an armed board may be another one.
        self.missions.use(store, now, is_same_board=self.session.met_family == controller.profile.family)
        self._say(self._announcer.found(controller, now))
        self._calibration.controller_found(now)
        if not isinstance(store, Refusal):
            # Read its list at once: MISSION_CURRENT reports the count, and the first Read needs no wait.
            self._watch.due = now

    def _mavlink_received(self, frames: list[MavlinkFrame]) -> None:
        if self._incoming.routes is not None:
            self._incoming.routes.from_autopilot(frames)

    def _pass_on_news(self, now: float) -> None:
        if self.report.watched:
            self.session.settle_telemetry()
        if not self.session.vehicle.news:
            return
        news = self.session.vehicle.take_news()
        if self.report.watched:
            self.report.heard(news)
        if not self.is_passing_through:
            self._vehicle.heard(news, now)
            if Health in news or Readiness in news:
                self._parameters.follow()
        if MissionLeg in news and (leg := self.session.vehicle.last(MissionLeg)) is not None:
            self.missions.follow(leg.status)
        if FlightState in news:
            self._follow_arming(now)
            self._remember_flight(now)

    def _remember_flight(self, now: float) -> None:
        if self.session.vehicle.armed is None or self.is_passing_through:
            return
        before, memory = self.flight, self.session.flight_memory(now)
        if before is None or memory is None or replace(memory, made_at=before.made_at, mode=before.mode) != before:
            self.flight = memory

    def _follow_arming(self, now: float) -> None:
        armed = self.session.vehicle.armed
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
