# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge as a whole: one flight controller on one side, ground stations on the other. Sans-IO.

The service feeds in bytes, time and the store's answers, and then takes the effects (bridge/effects.py).
The path of a byte from the UART:
    fc_received -> FcSession -> MspLink -> Vehicle -> OwnVehicle -> Ground -> take
The path of a mission item to the flight controller, and back for verification:
    gcs_received -> Incoming -> Ground, GroundStation -> MissionUploads -> ListCheck
        -> MissionService.deliver -> FcMissionStore.push -> MspLink
An autopilot that speaks MAVLink itself is not represented but passed through, both ways:
    FcSession <-> Routes <-> Ground
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Any, Protocol

from bridge.config import BridgeConfig, PassThroughRule
from bridge.effects import BridgeEffect, PublishGroups, RecordFrames, RememberFlight, SendToBoard
from bridge.fc.profile import FlightController, RuleSettings, Spoken
from bridge.fc.session import FcSession
from bridge.fc.states.base import FcLine
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation
from bridge.gcs.rights import LinkAccess
from bridge.gcs.routes import Routes
from bridge.gcs.station import Peer
from bridge.line.conversation import StoreEffect
from bridge.line.runner import Runner
from bridge.missions.mission_service import MissionService
from bridge.model.events import Armed, Disarmed
from bridge.model.missions import ARMED, Refusal
from bridge.model.settings import SettingsState
from bridge.model.vehicle import FlightState, GlobalPosition, Health, Readiness
from bridge.settings.board_settings import BoardSettings
from bridge.settings.local_settings import LocalSettings
from bridge.settings.parameters import OwnParameters, Parameters
from bridge.sharing.msp_sharing import MspSharing, Program
from bridge.transfers.local_missions import LocalMissions
from bridge.transfers.mission_types import MissionTypes
from bridge.transfers.mission_watch import MissionWatch
from bridge.transfers.uploads import FC_LOST, STOPPED
from bridge.vehicle.calibration import Calibration
from bridge.vehicle.commands import CommandService, SetWaypoint
from bridge.vehicle.compass_check import CompassCheck
from bridge.vehicle.incoming import Incoming
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.vehicle.readiness import CraftReadiness
from bridge.vehicle.vehicle_report import VehicleReporter
from bridge.voice.sentences import OF_THE_PI
from protocols.mavlink.frame import MavlinkFrame
from reports.vehicle_groups import Group, VehicleReport


@dataclass(frozen=True, slots=True)
class Counters:
    """Counted since the start."""

    #: Frames of ground stations: damaged and refused, by link and reason.
    bad_frames: int
    refused: Mapping[tuple[str, str], int]
    #: Requests of programs on a share, by reason.
    refused_by_share: Mapping[str, int]
    firmware_version: tuple[int, int, int] | None
    settings: SettingsState | None
    #: If it is wrong at the craft's place: degrees off, the setting, and the value that it needs.
    declination: tuple[Any, ...] | None


class TimedPart(Protocol):
    """A part with a timer. `tick` is called at `due` or later and sets the next `due`, infinity without one."""

    @property
    def due(self) -> float:
        """Monotonic s."""

    def tick(self, now: float) -> None:
        """Do what is due."""


class Bridge:
    """The whole bridge. Its public methods are all that service/ uses. The parts behind them are private.

    After each input, carry out the effects, and call `tick` at `due`:

    >>> bridge.gcs_received(peer, data, now, datagram=True)
    >>> for effect in bridge.take():
    ...     match effect:
    ...         case SendToBoard(data): port.write(b"".join(data))
    """

    def __init__(self, config: BridgeConfig, now: float) -> None:
        self._config = config
        #: To be carried out, in order. `take` adds the datagrams and the bytes for the board.
        self._effects: list[BridgeEffect] = []
        #: The line's state, speed or polls may have changed since the last `take`. A conversation that starts has
        #: output, or waits for a reply or timeout that the line already expects.
        self._has_line_changed = True
        #: Since the last `take` only frames of a passed-through autopilot arrived, which postpone `due`: for thousands
        #: a second, anything else would cost too much.
        self._has_only_passed_on = False
        #: The time of the next `tick`, and of the line's own, as of the last `take`.
        self.due = self._line_due = now
        #: The armed craft as last remembered. It changes rarely.
        self._flight = config.flight
        self._was_armed = False
        #: True while an autopilot speaks MAVLink itself: the bridge then does not send anything in its name.
        self.is_passing_through = False

        emit, ids = self._effects.append, (config.settings.sysid, config.compid)
        # Ground stations, and the line to the flight controller.
        ground = self._ground = Ground(
            *ids, emit, self._newcomer, *_access(config), config.is_near, is_recorded=config.has_log
        )
        routes = self._routes = Routes(ground)
        runner = self._runner = Runner(emit)
        fc_line = FcLine(config.speeds, config.profiles, runner, routes.from_autopilot)
        session = self._session = FcSession(fc_line, emit, self._controller_changed, config.flight)
        #: The flight controller's readings, which are kept when it is lost.
        self.vehicle = fc_line.vehicle
        # Missions, fences and rally points.
        missions = self._missions = MissionService(fc_line.vehicle, runner, emit)
        readiness = self._readiness = CraftReadiness(
            session, missions, ground, now, was_found=config.flight is not None, is_wired=None not in config.speeds
        )
        types = self._types = MissionTypes(missions, ground, emit)
        self._watch = MissionWatch(missions, ground, emit)
        #: Missions, for the command line, the page and zenoh.
        self.missions = LocalMissions(missions, types.of_missions, ground, emit)
        # The board's settings, and other programs' requests.
        settings = self._board_settings = BoardSettings(session, missions, ground, emit, config.settings_memory)
        sharing = self._sharing = MspSharing(session, missions, ground, emit, settings)
        #: Settings, for the command line, the page and zenoh.
        self.settings = LocalSettings(settings, session)
        # The vehicle that ground stations see.
        own = self._own_vehicle = OwnVehicle(
            session, missions, ground, readiness, types.capabilities, config.unix_time_s, now
        )
        self._reporter = VehicleReporter(session, missions, ground, settings, readiness, own.also_want, own.progress)
        own_parameters = OwnParameters(fc_line.vehicle, config.settings.sysid)
        parameters = self._parameters = Parameters(own_parameters, settings, ground)
        calibration = self._calibration = Calibration(ground, session, missions, readiness, settings)
        self._compass_check = CompassCheck(fc_line.vehicle, ground)
        waypoint = SetWaypoint(missions, own, ground)
        commands = CommandService(ground, own, session, calibration, settings, parameters, waypoint, config.version)
        self._incoming = Incoming(ground, types.by_type, parameters, commands, own, session.send_mavlink, *ids, emit)
        #: Served in this order, after the line itself.
        self._parts: list[TimedPart] = [runner, sharing, *types.uploads, self._watch, settings]
        self._parts += [parameters, ground, readiness, calibration, own, self._reporter]

    def take(self) -> list[BridgeEffect]:
        """What is to be done since the last call: first what must not wait, then the rest as it arose."""
        effects: list[BridgeEffect] = []
        if self._ground.outbox.outgoing:
            effects.append(self._ground.outbox.take())
        if self._has_only_passed_on:
            self._has_only_passed_on = False
        else:
            session = self._session
            if session.output or self._has_line_changed:
                state = session.state
                self._has_line_changed, self._line_due = False, state.due
                data = [*session.output]
                session.output.clear()
                # Heartbeats and other broadcasts are not replied to.
                asks = not self.is_passing_through or any(MavlinkFrame(frame).has_target_field for frame in data)
                complete_at = -inf if state.link is None else state.link.complete_at
                effects.append(SendToBoard(data, state.speed, self.is_passing_through, asks, complete_at))
            due = self._line_due
            for part in self._parts:
                if (part_due := part.due) < due:
                    due = part_due
            self.due = due
        if recorded := self._ground.outbox.recorded:
            effects.append(RecordFrames(recorded))
            recorded.clear()
        if fresh := self._reporter.fresh:
            effects.append(PublishGroups(frozenset(fresh)))
            fresh.clear()
        if self._effects:
            effects += self._effects
            self._effects.clear()
        return effects

    # The flight controller's side.

    def fc_opened(self, now: float) -> None:
        self._has_line_changed = True
        self._session.opened(now)

    def fc_closed(self, now: float, why: str | None) -> None:
        """The port was lost. `why` is None if the bridge closed it itself."""
        self._has_line_changed = True
        self._session.closed(now, why)

    def fc_received(self, data: bytes, now: float) -> bool:
        """Handle bytes from the port. Returns False if they ended inside a frame and nothing else has changed."""
        self._has_line_changed = True
        event = self._session.state.receive(data, now)
        if event is not None:
            self._session.handle(event, now)
        self._has_only_passed_on = self.is_passing_through
        if not self.is_passing_through or self.vehicle.news or self._reporter.watched:
            self._follow_line(now)
        return not self._session.state.is_mid_frame

    @property
    def fc_trouble(self) -> str:
        """The reason why the board cannot be used, and the remedy, or empty if it can be."""
        trouble = self._session.state.trouble
        return "" if trouble is None else trouble.text

    # The ground stations' side.

    def gcs_received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> bool:
        """Handle bytes from a ground station. Returns False if they are dropped. A datagram holds whole frames only."""
        return self._incoming.received(peer, data, now, datagram=datagram)

    def gcs_gone(self, peer: Peer, now: float) -> None:
        self._types.peer_gone(peer, now)
        self._ground.gone(peer)

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """Send to `peer` before it is heard. `until_answered`: only while no peer is heard on the link (broadcast)."""
        self._ground.add_default_peer(peer, until_answered=until_answered)

    def remove_default_peer(self, peer: Peer) -> None:
        self._ground.remove_default_peer(peer)

    def is_connected(self, peer: Peer) -> bool:
        return self._ground.is_connected(peer)

    def notify(self, text: str) -> None:
        """Show a text to each ground station that connects from now on."""
        self._ground.notices.append(OF_THE_PI(text))

    # Other programs, on a share.

    def program_joined(self, program: Program) -> None:
        self._sharing.join(program)

    def program_left(self, program: Program) -> None:
        self._sharing.leave(program)

    def program_received(self, program: Program, data: bytes, now: float) -> None:
        self._has_line_changed = True
        self._sharing.received(program, data, now)

    # The store, and the end of the bridge.

    def store_answered(self, effect: StoreEffect, answer: object, now: float) -> None:
        self._runner.store_answered(effect, answer, now)

    def stop_missions(self, now: float) -> None:
        """Accept no more transfers. An upload that still receives items ends. A running push continues."""
        self._types.close()
        self._sharing.stop()
        self._types.end_uploads(STOPPED, now)

    def abort(self, now: float) -> None:
        """End the running conversation cleanly."""
        self._runner.stop(now)

    # For metrics, the status and other followers.

    def watch(self, groups: Iterable[Group]) -> None:
        """Poll for these groups from now on, and have those updated published."""
        self._has_line_changed = True
        self._reporter.watch(groups)

    def report(self, now: float) -> VehicleReport:
        return self._reporter.whole(now)

    def group(self, group: Group, now: float) -> Any:
        """The current values of a group: an instance of the class in reports.vehicle_groups."""
        return self._reporter.group(group, now)

    def counters(self) -> Counters:
        return Counters(
            bad_frames=self._ground.bad_frames,
            refused=self._incoming.refused,
            refused_by_share=self._sharing.refused,
            firmware_version=self.vehicle.version,
            settings=self._board_settings.known.state,
            declination=None if (wrong := self._compass_check.wrong) is None else wrong.values,
        )

    # Time.

    @property
    def is_busy(self) -> bool:
        """True while a conversation with the flight controller runs or waits."""
        return self._runner.is_busy

    def restart(self, why: str, now: float) -> None:
        """Recover from a bug: end the running conversation and search for the flight controller again."""
        self._has_line_changed = True
        self._runner.reset(now)
        self.settings.reset()
        self._session.restart(why, now)

    def tick(self, now: float) -> None:
        self._has_line_changed = True
        self._session.tick(now)
        for part in self._parts:
            if now >= part.due:
                part.tick(now)
        if self._session.state.controller is None and self._missions.fc_store != self._readiness.refusal:
            self._types.lost(self._readiness.refusal, FC_LOST, now)
        self._follow_line(now)

    # Events from one part to another.

    def _newcomer(self, station: GroundStation, now: float) -> None:
        if not self.is_passing_through:
            self._own_vehicle.newcomer(station, now)

    def _controller_changed(self, controller: FlightController | None, now: float) -> None:
        self.is_passing_through = controller is not None and controller.profile.spoken is Spoken.OTHER_MAVLINK
        self._routes.forget()
        self._incoming.routes = self._routes if self.is_passing_through else None
        # A passed-through autopilot represents itself.
        self._own_vehicle.due = inf if self.is_passing_through else min(self._own_vehicle.due, now)
        self._board_settings.found(controller, now)
        if controller is None:
            self._readiness.lost(now if self.vehicle.heard_at is None else self.vehicle.heard_at)
            self._types.lost(self._readiness.refusal, FC_LOST, now)
            return
        profile, rules = controller.profile, RuleSettings(self._config.settings.takeoff_max_m)
        missions = profile.missions
        store = missions if isinstance(missions, Refusal) else missions(controller, self.vehicle, rules)
        stores = store, profile.fences(controller, self.vehicle), profile.rally(controller, self.vehicle)
        # On a port that was opened since, an armed board may be another.
        self._types.use(stores, now, is_same_board=self._session.met_family == profile.family)
        self._readiness.found(controller, now)
        self._calibration.controller_found(now)
        if not isinstance(store, Refusal):
            # Read the list at once: MISSION_CURRENT reports the count, and the first Read does not need a wait.
            self._watch.due = now

    def _follow_line(self, now: float) -> None:
        """Pass on new readings, and serve programs, which may use the line when no poll is due."""
        is_watched = self._reporter.watched
        if is_watched:
            self._session.settle_telemetry()
        if self.vehicle.news:
            news, self.vehicle.news = self.vehicle.news, set()
            if is_watched:
                self._reporter.heard(news, now)
            if not self.is_passing_through:
                self._own_vehicle.heard(news, now)
                settings = self._board_settings
                if GlobalPosition in news and settings.is_checked and settings.known.table is not None:
                    self._compass_check.follow(settings.known.table)
                if Health in news or Readiness in news:
                    self._parameters.follow()
            if FlightState in news:
                self._follow_arming(now)
                self._remember_flight(now)
        if self._board_settings.known.table is not self._parameters.followed:
            self._parameters.follow()
        if self._sharing.due < inf:
            self._sharing.tick(now)

    def _remember_flight(self, now: float) -> None:
        if self.vehicle.armed is None or self.is_passing_through:
            return
        before, memory = self._flight, self._session.flight_memory(now)
        is_same = memory is before
        if before is not None and memory is not None:
            is_same = replace(memory, made_at=before.made_at) == before
        if not is_same:
            self._flight = memory
            self._effects.append(RememberFlight(memory))

    def _follow_arming(self, now: float) -> None:
        armed = self.vehicle.armed
        if armed is None or armed == self._was_armed:
            # Unknown is not a change: a Harakiri that arms may fall silent first.
            return
        self._was_armed = armed
        if armed:
            self._types.end_uploads(ARMED, now)
        self._board_settings.arming_changed(now, is_armed=armed)
        if self._config.has_log:
            self._ground.record_flight(on=armed and not self.is_passing_through)
        self._effects.append(Armed() if armed else Disarmed())


def _access(config: BridgeConfig) -> tuple[Mapping[str, LinkAccess], LinkAccess]:
    """The rules of each link, and of those without rules."""
    everything = config.settings.pass_through is PassThroughRule.EVERYTHING
    links = {name: replace(access, passes_everything=everything) for name, access in config.access.items()}
    return links, LinkAccess(passes_everything=everything)
