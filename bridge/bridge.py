# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge as a whole: one flight controller on one side, ground stations on the other. Sans-IO.

The service feeds in bytes, time and the store's answers, and then takes the effects (bridge/effects.py).
The path of a byte from the UART:
    fc_received -> FcSession -> MspLink -> Vehicle -> OwnVehicle -> Ground -> take
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
from bridge.effects import BridgeEffect, PublishGroups, RecordFrames, RememberFlight, SendToBoard
from bridge.fc.profile import FlightController, RuleSettings, Spoken
from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation
from bridge.gcs.rights import LinkAccess
from bridge.gcs.routes import Routes
from bridge.gcs.station import Peer, Severity
from bridge.line.msp_link import RoundTrips
from bridge.line.runner import Runner
from bridge.missions.mission_service import NO_LINK, MissionService
from bridge.missions.place_lists import PlaceLists
from bridge.model.events import Armed, Disarmed
from bridge.model.refusal import ARMED, Refusal
from bridge.model.settings import SettingsState
from bridge.model.vehicle import FlightState, Health, MissionLeg, Readiness
from bridge.settings.board_settings import BoardSettings
from bridge.settings.local_settings import LocalSettings
from bridge.settings.own_parameters import OwnParameters
from bridge.settings.parameters import Parameters
from bridge.settings.settings_backups import BackupTaker
from bridge.settings.settings_seal import SettingsSeal
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
from bridge.vehicle.message_router import MessageRouter, Transfers
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.vehicle.set_waypoint import SetWaypoint
from bridge.vehicle.vehicle_report import VehicleReporter
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionResult
from reports.vehicle_groups import Group


@dataclass(frozen=True, slots=True)
class Counters:
    """Counted since the start; those of the flight controller since it was found, None without MSP."""

    ground_stations: int
    #: Frames of ground stations: damaged ones, and refused ones, by link and reason.
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
    """A part with a timer. `tick` is called at `due` or later and sets the next `due`; infinity means no timer."""

    @property
    def due(self) -> float:
        """Monotonic s."""

    def tick(self, now: float) -> None:
        """Do what is due."""


class Bridge:
    """The whole bridge. Its public methods are all that service/ uses; the parts behind them are private.

    After each input, carry out the effects, and call `tick` at `due`:

    >>> bridge.gcs_received(peer, data, now, datagram=True)
    >>> for effect in bridge.take():
    ...     match effect:
    ...         case SendToBoard(data): port.write(b"".join(data))
    """

    def __init__(self, config: BridgeConfig, now: float) -> None:
        self._config, owner = config, config.settings
        #: To be carried out, in order. Datagrams and bytes for the board are added by `take`.
        self._effects: list[BridgeEffect] = []
        emit = self._emit = self._effects.append
        self._was_armed = False
        #: The line's state, speed or polls may have changed since the last `take`. A conversation that starts has
        #: output, or waits for a reply or timeout that the line already expects.
        self._has_line_changed = True
        #: Since the last `take` only frames of a passed-through autopilot arrived, which postpone `due`: for thousands
        #: a second, anything else would cost too much.
        self._has_only_passed_on = False
        #: The time of the next `tick`, and of the line's own, as of the last `take`.
        self.due = self._line_due = now
        #: The armed craft as last remembered; it changes rarely.
        self._flight = config.flight
        #: True while an autopilot speaks MAVLink itself: the bridge then sends nothing in its name.
        self.is_passing_through = False
        self._announcer = LinkAnnouncer(
            self._say, lambda: self._session.state.trouble, now, was_found=config.flight is not None
        )
        incidents = count(1)

        passes_everything = owner.pass_through is PassThroughRule.EVERYTHING
        ground = self._ground = Ground(
            owner.sysid,
            config.compid,
            emit,
            self._newcomer,
            {name: replace(access, passes_everything=passes_everything) for name, access in config.links.items()},
            LinkAccess(passes_everything=passes_everything),
            config.is_near,
            is_recorded=config.has_log,
        )
        self._routes = Routes(ground)
        runner = self._runner = Runner(emit)
        session = self._session = FcSession(
            config.speeds,
            config.profiles,
            runner,
            emit,
            incidents,
            self._controller_changed,
            self._routes.from_autopilot,
            owner.autopilot,
            config.flight,
        )
        #: Its readings, which are kept when it is lost.
        self.vehicle = self._session.vehicle
        missions = self._missions = MissionService(self.vehicle, runner, emit)
        self._sharing = MspSharing(session, runner, missions, emit, self._say_refused)

        def is_transferring() -> bool:
            return self.missions.transfer is not None

        own = self._own_vehicle = OwnVehicle(session, missions, ground, self._announcer, config.unix_time_s, now)
        #: The seal of the flight controller's settings.
        self._seal = SettingsSeal(session, missions, ground, emit, config.seals, is_transferring)
        self._board_settings = BoardSettings(session, missions, emit, is_transferring, lambda: self._sharing.due < inf)
        self._board_settings.on_change = self._changed_settings
        self._seal.on_found_change = self._found_changed_settings
        self._sharing.on_change = self._program_changed_settings
        self._backups = BackupTaker(emit)
        self._seal.on_identified = self._backups.identified
        self._board_settings.on_read = lambda table: self._backups.read(table, self._board_settings.unsaved)
        self._board_settings.on_saved = self._backups.saved
        #: The board's settings, for the command line, the page and zenoh.
        self.settings = LocalSettings(self._board_settings, session)
        self._reporter = VehicleReporter(session, missions, ground, self._seal, own.also_want, own.progress)
        self._uploads = MissionUploads(missions, ground, emit, incidents, own.let_read)
        #: Missions, for the same.
        self.missions = LocalMissions(missions, self._uploads, ground, emit, incidents)
        self._watch = MissionWatch(missions, ground, emit)
        fence, rally = messages.MAV_MISSION_TYPE_FENCE, messages.MAV_MISSION_TYPE_RALLY
        # The check of a mission also uses them.
        changed = missions.settings_changed
        self._fences = PlaceLists(fence, "Fence", self.vehicle, runner, changed)
        self._rally = PlaceLists(rally, "Rally points", self.vehicle, runner, changed)
        transfers = {
            messages.MAV_MISSION_TYPE_MISSION: Transfers(missions, self._uploads, MissionDownloads(missions, ground))
        }
        for places in (self._fences, self._rally):
            uploads = MissionUploads(places, ground, emit, incidents, own.let_read)
            uploads.answers.are_only_missions_stored = False
            transfers[places.mission_type] = Transfers(places, uploads, MissionDownloads(places, ground))
        self._all_uploads = tuple(each.uploads for each in transfers.values())
        own.capabilities = self._capabilities
        own_parameters = OwnParameters(missions, ground, owner.sysid)
        own_parameters.on_radius_set = self._board_settings.saved_with_mission
        parameters = self._parameters = Parameters(own_parameters, self._board_settings, ground)
        self._calibration = Calibration(ground, session, missions, self._announcer, self._board_settings)
        commands = CommandService(
            ground,
            own,
            session,
            self._calibration,
            self._board_settings,
            parameters,
            SetWaypoint(missions, own, ground),
            config.version,
        )
        router = MessageRouter(ground, transfers, parameters, commands, own)
        self._incoming = Incoming(ground, router, parameters, session.send_mavlink, owner.sysid, config.compid, emit)
        #: Served in this order, after the line itself.
        self._parts: tuple[TimedPart, ...] = (
            runner,
            self._sharing,
            *self._all_uploads,
            self._watch,
            self._seal,
            self._board_settings,
            parameters,
            ground,
            self._announcer,
            self._calibration,
            own,
            self._reporter,
        )

        # The front door: calls that one part answers. First the ground stations' side.
        self.gcs_received = self._incoming.received
        self.add_default_peer, self.remove_default_peer = ground.add_default_peer, ground.remove_default_peer
        self.is_connected = ground.is_connected
        #: Other programs, on a share.
        self.program_joined, self.program_left = self._sharing.join, self._sharing.leave
        #: Shows a text to each ground station that connects from now on.
        self.notify = ground.notices.append
        self.store_answered = runner.store_answered
        #: Ends the running conversation cleanly.
        self.abort = runner.stop
        self.report, self.group = self._reporter.whole, self._reporter.group

    def take(self) -> list[BridgeEffect]:
        """What is to be done since the last call, in order. Mostly a few datagrams, or bytes for the board."""
        effects: list[BridgeEffect] = []
        if self._effects:
            effects += self._effects
            self._effects.clear()
        if datagrams := self._ground.take_datagrams():
            effects.append(datagrams)
        if recorded := self._ground.recorded:
            effects.append(RecordFrames(tuple(recorded)))
            recorded.clear()
        if fresh := self._reporter.fresh:
            effects.append(PublishGroups(frozenset(fresh)))
            fresh.clear()
        if self._has_only_passed_on:
            self._has_only_passed_on = False
            return effects
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
        return effects

    # The flight controller's side.

    def fc_opened(self, now: float) -> None:
        self._has_line_changed = True
        self._session.opened(now)

    def fc_closed(self, now: float, why: str | None) -> None:
        """The port was lost; `why` is None if the bridge closed it itself."""
        self._has_line_changed = True
        self._session.closed(now, why)

    def fc_received(self, data: bytes, now: float) -> bool:
        """Handle bytes from the port; False if they ended inside a frame and nothing else has changed."""
        self._has_line_changed = True
        self._session.received(data, now)
        self._follow_line(now)
        self._has_only_passed_on = self.is_passing_through
        return not self._session.state.is_mid_frame

    @property
    def fc_trouble(self) -> str:
        """The reason why the board cannot be used, and the remedy; empty if it can be."""
        return self._session.state.trouble

    @property
    def is_searching(self) -> bool:
        """True while a port is open and the flight controller is not identified yet."""
        return self._session.state.is_searching

    # The ground stations' side.

    def gcs_gone(self, peer: Peer, now: float) -> None:
        for uploads in self._all_uploads:
            uploads.peer_gone(peer, now)
        self._ground.gone(peer)

    def link_closed(self, name: str, now: float) -> None:
        """A link is closed, and all ground stations on it are gone."""
        for peer in self._ground.remove_link(name):
            for uploads in self._all_uploads:
                uploads.peer_gone(peer, now)

    # Other programs, on a share.

    def program_received(self, program: Program, data: bytes, now: float) -> None:
        self._has_line_changed = True
        self._sharing.received(program, data, now)

    def stop_missions(self, now: float) -> None:
        """Accept no more transfers. An upload that still receives items ends; a running push continues."""
        for lists in (self._missions, self._fences, self._rally):
            lists.close()
        self._sharing.stop()
        self._end_uploads(STOPPED, now)

    # For metrics, the status and other followers.

    def watch(self, groups: Iterable[Group]) -> None:
        """Poll for these groups from now on, and have the updated ones published."""
        self._has_line_changed = True
        self._reporter.watch(groups)

    def counters(self) -> Counters:
        state = self._session.state
        return Counters(
            ground_stations=len(self._ground.peers()),
            bad_frames=self._ground.bad_frames,
            refused=self._incoming.refused,
            refused_by_share=self._sharing.refused,
            fc_bad_checksums=state.bad_checksums or 0,
            fc_requests_lost=None if state.link is None else state.link.requests_lost,
            fc_round_trips=None if state.link is None else state.link.round_trips,
            firmware_version=self.vehicle.version,
            settings=self._seal.state,
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
        self._session.restart(why, now)

    def tick(self, now: float) -> None:
        self._has_line_changed = True
        self._session.tick(now)
        for part in self._parts:
            if now >= part.due:
                part.tick(now)
        self._follow_line(now)

    # Between the parts.

    def _say(self, severity: Severity, text: str) -> None:
        if not self.is_passing_through:
            self._ground.say(severity, text)

    def _say_refused(self, text: str) -> None:
        """A program's request was refused. In flight a warning would cover what concerns the craft."""
        self._ground.say(Severity.NOTICE if self.vehicle.armed else Severity.WARNING, text)

    def _end_uploads(self, refusal: Refusal, now: float) -> None:
        for uploads in self._all_uploads:
            if uploads.due < inf:
                uploads.end(refusal, now)

    def _capabilities(self) -> int:
        fence = self._fences.are_stored and messages.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        return fence | (self._rally.are_stored and messages.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY)

    def _changed_settings(self, now: float) -> None:
        self._seal.changed_here(now)
        self._missions.settings_changed()

    def _found_changed_settings(self, now: float) -> None:
        self._board_settings.may_have_changed(now)
        self._missions.settings_changed()

    def _program_changed_settings(self, now: float) -> None:
        self._changed_settings(now)
        self._board_settings.may_have_changed(now)

    def _newcomer(self, station: GroundStation, now: float) -> None:
        if not self.is_passing_through:
            self._own_vehicle.newcomer(station, now)

    def _controller_changed(self, controller: FlightController | None, now: float) -> None:
        self.is_passing_through = controller is not None and controller.profile.spoken is Spoken.OTHER_MAVLINK
        self._routes.forget()
        self._incoming.routes = self._routes if self.is_passing_through else None
        # A passed-through autopilot represents itself.
        self._own_vehicle.due = inf if self.is_passing_through else min(self._own_vehicle.due, now)
        self._backups.found()
        self._seal.found(controller, now)
        self._board_settings.found(controller, now)
        if controller is None:
            trouble = self._session.state.trouble
            refusal = Refusal(MissionResult.DENIED, trouble) if trouble else NO_LINK
            for lists in (self._missions, self._fences, self._rally):
                lists.use(refusal, now, is_same_board=True)
            self._end_uploads(FC_LOST, now)
            self._announcer.lost(now if self.vehicle.heard_at is None else self.vehicle.heard_at)
            return
        missions = controller.profile.missions
        rules = RuleSettings(self._config.settings.takeoff_max_m)
        store = missions if isinstance(missions, Refusal) else missions(controller, self.vehicle, rules)
        # On a port that was opened since, an armed board may be another one.
        is_same_board = self._session.met_family == controller.profile.family
        self._missions.use(store, now, is_same_board=is_same_board)
        for places, opened in ((self._fences, controller.profile.fences), (self._rally, controller.profile.rally)):
            places.use(opened(controller, self.vehicle), now, is_same_board=is_same_board)
        self._uploads.answers.are_only_missions_stored = not self._capabilities()
        self._announcer.found(controller, now)
        self._calibration.controller_found(now)
        if not isinstance(store, Refusal):
            # Read its list at once: MISSION_CURRENT reports the count, and the first Read needs no wait.
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
                if Health in news or Readiness in news:
                    self._parameters.follow()
            if MissionLeg in news and (leg := self.vehicle.last(MissionLeg)) is not None:
                self._missions.follow(leg.report)
            if FlightState in news:
                self._follow_arming(now)
                self._remember_flight(now)
        if self._sharing.due < inf:
            self._sharing.tick(now)

    def _remember_flight(self, now: float) -> None:
        if self.vehicle.armed is None or self.is_passing_through:
            return
        before, memory = self._flight, self._session.flight_memory(now)
        is_same = memory is before
        if before is not None and memory is not None:
            is_same = replace(memory, made_at=before.made_at, mode=before.mode) == before
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
            self._end_uploads(ARMED, now)
            self._seal.armed()
        self._ground.record_flight(on=armed and not self.is_passing_through)
        self._emit(Armed() if armed else Disarmed())
