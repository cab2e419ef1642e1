# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicle that ground stations see while the flight controller does not represent itself. Sans-IO.

It exists from the start and keeps the ids, so when the craft arms and switches protocol, ground stations still see the
same vehicle.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from math import floor, inf

from bridge.fc.profile import POLL_FOR
from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation, Sender
from bridge.gcs.message_rates import fastest_s, take_due
from bridge.missions.mission_service import MissionService
from bridge.model.craft import FlightMode, Home
from bridge.model.missions import FlightReport, FlownMission, MissionProgress
from bridge.model.vehicle import STALE_S, FlightState, Health, MissionLeg, Mode, Readiness, Reading
from bridge.vehicle import vehicle_messages as make
from bridge.vehicle.readiness import CraftReadiness, ReadyState
from bridge.vehicle.telemetry_table import NO_STREAM, TELEMETRY, Row
from bridge.vehicle.vehicle_messages import Moment
from bridge.voice import sentences
from bridge.voice.happening import Happening
from protocols.mavlink.codec import pack
from protocols.mavlink.dialect import messages
from protocols.msp.commands import Msp
from protocols.msp.mission_flight import SUMMARY
from protocols.msp.nav import NavState, NavStatus
from reports.vehicle_groups import Progress
from reports.verdict import SentSeqs

#: The interval of HEARTBEAT, and the clock for messages without a reading.
_TICK_S = 1.0
#: Mission Planner needs two heartbeats to connect: a newcomer gets one every 0.2 s for 3 s.
_NEWCOMER_S, _NEWCOMER_INTERVAL_S = 3.0, 0.2
#: Values are unknown without a reading for this long: SYS_STATUS is sent anyway, and items are not shown as flown to.
_SILENT_S = 3.0
#: Longer than MAVSDK waits for a changed MISSION_CURRENT (2.5 s).
_NO_CURRENT_S = 4.0
#: The shortest interval that a ground station may request.
_FASTEST_S = 0.01
_ALL_STREAMS = messages.MAV_DATA_STREAM_ALL
_ROWS = {row.msgid: row for row in TELEMETRY}
_DEFAULTS_S = {row.msgid: row.interval_s for row in TELEMETRY}
#: A message, and the reading that triggers it, or None for the clock.
_Trigger = tuple[Row, type[Reading] | None]
_SYS_STATUS = _ROWS[messages.MAVLINK_MSG_ID_SYS_STATUS]
_EXTENDED_SYS_STATE = _ROWS[messages.MAVLINK_MSG_ID_EXTENDED_SYS_STATE]


class OwnVehicle:
    """Sends the vehicle's messages to each ground station at the rates that it requests."""

    def __init__(
        self,
        session: FcSession,
        missions: MissionService,
        ground: Ground,
        readiness: CraftReadiness,
        capabilities: Callable[[], int],
        unix_time_s: Callable[[float], float | None],
        now: float,
    ) -> None:
        self._session = session
        self._missions = missions
        self._ground = ground
        self.readiness = readiness
        self._unix_time_s = unix_time_s
        self._started_at = now
        self.due = self._second_ends = now
        #: The messages that any ground station requests, by the reading that triggers them.
        self._rows: dict[type[Reading] | None, list[_Trigger]] = {}
        self.progress = MissionProgress()
        #: The capability bits of this flight controller, besides the bridge's own.
        self._capabilities = capabilities
        self._announced_home: Home | None = None
        self._also_wanted: Mapping[type[Reading], float] = {}
        #: The intervals of the messages and readings that `_rows` and the polls follow.
        self._requested_rates: object = None
        self._newcomers_due = inf
        #: Armed, mode, failsafe and lost as last announced.
        self._announced: tuple[bool | None, FlightMode | str | None, bool, bool] | None = None
        #: The ground stations whose waypoint was set since the last report of the board.
        self._asked_current: list[Sender] = []
        self._is_emergency = False
        self.hear_station_time = session.vehicle.hear_station_time
        #: What a Harakiri's flight has decided, as it was last sent.
        self._summary = 0
        #: The last reason for the stop of a mission flight.
        self._said_why: Happening | None = None

    @property
    def stores_fences(self) -> bool:
        return bool(self._capabilities() & messages.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE)

    def newcomer(self, station: GroundStation, now: float) -> None:
        """Send a new ground station more heartbeats, so that it connects sooner, then home and why it cannot arm."""
        station.greeted_until, station.is_informed = now + _NEWCOMER_S, False
        self._newcomers_due = min(self._newcomers_due, now + _NEWCOMER_INTERVAL_S)
        self.due = min(self.due, self._newcomers_due)
        self._beat(now, [station])

    def tick(self, now: float) -> None:
        if now >= self._newcomers_due:
            self._greet(now)
        if now >= self._second_ends:
            self._end_second(now)
        self.due = min(self._second_ends, self._newcomers_due)

    def _end_second(self, now: float) -> None:
        # Polls are also due at whole seconds: one wake-up serves both.
        self._second_ends = floor(now) + _TICK_S
        everyone = self._ground.everyone
        self._set_polls(everyone)
        self.readiness.follow(now)
        self._beat(now, everyone)
        self._send_due(self._rows.get(None, ()), now)
        if self.readiness.state is ReadyState.CALIBRATING or not self._session.vehicle.fresh(Health, now, _SILENT_S):
            # No reading triggers it now: the flight controller is lost.
            self._send_due([(_SYS_STATUS, None), (_EXTENDED_SYS_STATE, None)], now)
        self._announce_home(now)
        self._inform_newcomers(everyone, now)

    def _greet(self, now: float) -> None:
        newcomers = [station for station in self._ground.everyone if now < station.greeted_until]
        self._newcomers_due = now + _NEWCOMER_INTERVAL_S if newcomers else inf
        self._set_polls(self._ground.everyone)
        self._beat(now, newcomers)

    def _inform_newcomers(self, everyone: Sequence[GroundStation], now: float) -> None:
        """Tell home and the reasons not to arm."""
        newcomers = [station for station in everyone if not station.is_informed]
        for message in self._moment(now).made(make.home_position) if newcomers else ():
            self._ground.outbox.multicast(pack(message), newcomers)
        for station in newcomers:
            station.is_informed = True
            if not station.is_listener:
                self.readiness.tell(station)

    def heard(self, news: Collection[type[Reading]], now: float) -> None:
        """Send the messages that new readings trigger, where due."""
        if Readiness in news or FlightState in news:
            self.readiness.follow(now)
        triggered: list[_Trigger] = []
        for reading in news:
            triggered += self._rows.get(reading, ())
        self._send_due(triggered, now)
        if MissionLeg in news:
            self._follow_mission(now)
        if FlightState in news or Mode in news:
            self._follow_state(now)

    def _send_due(self, triggered: Iterable[_Trigger], now: float) -> None:
        everyone, fresh = self._ground.everyone, self._session.vehicle.fresh
        at: Moment | None = None
        for row, heard in triggered:
            if row.other is heard and row.reading is not None and heard is not None and fresh(row.reading, now):
                continue
            stations = take_due(everyone, row.msgid, row.interval_s, now)
            if stations and row.msgid == messages.MAVLINK_MSG_ID_MISSION_CURRENT:
                self._send_current(stations, now)
            elif stations:
                at = at or self._moment(now)
                for message in at.made(row.maker):
                    self._ground.outbox.multicast(pack(message), stations)
                    if row is _SYS_STATUS:
                        enabled = message.onboard_control_sensors_enabled
                        for station in stations:
                            station.sent_sys_status(
                                now, is_unhealthy=bool(enabled & ~message.onboard_control_sensors_health)
                            )

    def also_want(self, readings: Mapping[type[Reading], float]) -> None:
        """Set the poll intervals for consumers other than ground stations: seconds by reading."""
        self._also_wanted = readings
        self._set_polls(self._ground.everyone)

    # Requests of ground stations.

    def send_once(self, sender: Sender, msgid: int, now: float, index: int = 0) -> bool | None:
        """Send one message to a ground station. Returns False if the values are unknown, None if it does not exist.

        `index`: of the flight mode in AVAILABLE_MODES, from 1, or 0 if all.
        """
        if msgid == messages.MAVLINK_MSG_ID_AVAILABLE_MODES:
            modes = make.available_modes(self._session.vehicle)
            made = modes[index - 1 : index] if index else modes
            if not made:
                return None
        elif msgid == messages.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            # A restarted station would otherwise show home at 0, 0.
            version = make.autopilot_version(self._session.vehicle, self._capabilities())
            made = [version, *self._moment(now).made(make.home_position)]
        elif (row := _ROWS.get(msgid)) is not None:
            made = self._moment(now, self.sent_seqs(sender.station)).made(row.maker)
        else:
            return None
        for message in made:
            sender.to(message)
        return bool(made)

    def set_interval(self, station: GroundStation, msgid: int, interval_s: float | None) -> bool:
        """Set the interval of a message for one ground station, or the default if None. False: no such message."""
        if msgid not in _ROWS:
            return False
        # The polls follow later: that costs a step for every message and ground station.
        station.rates.request(msgid, None if interval_s is None else max(interval_s, _FASTEST_S))
        return True

    def refuse_current(self, sender: Sender, now: float) -> None:
        """Send MISSION_CURRENT to a ground station whose MISSION_SET_CURRENT was refused, or withhold it.

        Mission Planner's window hangs until one arrives. MAVSDK, which does not request streams, repeats the request at
        each that has another number, without end.
        """
        if sender.station.behaviour.streams:
            self.send_once(sender, messages.MAVLINK_MSG_ID_MISSION_CURRENT, now)
        else:
            self.withhold_current(sender.station, now)

    def withhold_current(self, station: GroundStation, now: float) -> None:
        """Hold MISSION_CURRENT back from a ground station until the MISSION_SET_CURRENT is answered."""
        station.rates.due[messages.MAVLINK_MSG_ID_MISSION_CURRENT] = now + _NO_CURRENT_S

    def confirm_current(self, sender: Sender) -> None:
        """Send MISSION_CURRENT to a ground station with the next report of the board."""
        self._asked_current.append(sender)

    def set_stream(self, station: GroundStation, stream: int, interval_s: float) -> None:
        """Set the interval of all messages of one of ArduPilot's streams."""
        station.behaviour.streams = True
        for row in TELEMETRY:
            if row.stream == stream or (stream == _ALL_STREAMS and row.stream != NO_STREAM):
                self.set_interval(station, row.msgid, interval_s)

    def _set_polls(self, everyone: Sequence[GroundStation]) -> None:
        """Set each poll to the highest rate requested."""
        polls, controller = self._session.polls, self._session.state.controller
        poll_for = POLL_FOR if controller is None else controller.profile.poll_for
        intervals_s = fastest_s(everyone, _DEFAULTS_S)
        if (requested_rates := (intervals_s, self._also_wanted, poll_for)) != self._requested_rates:
            self._requested_rates = requested_rates
            readings: list[tuple[type[Reading] | None, float]] = [*self._also_wanted.items()]
            self._rows = {}
            for row in TELEMETRY:
                interval_s = intervals_s[row.msgid]
                if interval_s < inf:
                    for trigger in row.readings:
                        self._rows.setdefault(trigger, []).append((row, trigger))
                readings.append((row.reading, interval_s))
            wanted: dict[Msp, float] = {}
            for kind, interval_s in readings:
                if kind is not None and (poll := poll_for.get(kind)) is not None:
                    wanted[poll] = min(wanted.get(poll, inf), interval_s)
            polls.want(wanted)
        polled = {} if self._session.state.link is None else poll_for
        line_s = {reading: polls.line_interval_s(poll) for reading, poll in polled.items()}
        # The line may be too slow to poll them every second.
        self._session.vehicle.stale_s = {kind: STALE_S * each_s for kind, each_s in line_s.items() if each_s > 1.0}

    def _moment(self, now: float, sent_seqs: SentSeqs = ()) -> Moment:
        boot_ms = int((now - self._started_at) * 1000) & 0xFFFFFFFF
        return Moment(
            self._session.vehicle,
            now,
            boot_ms,
            partial(self._flown_mission, now),
            self._unix_time_s,
            sent_seqs,
            self.readiness.state,
        )

    def _flown_mission(self, now: float) -> FlownMission:
        held = self._missions.on_board
        if held is None:
            return FlownMission()
        if not held.items:
            return FlownMission(held.items, 0, Progress.NO_MISSION)
        vehicle, seq = self._session.vehicle, self._missions.seq_of(self.progress.number)
        if vehicle.last(MissionLeg) is None or vehicle.fresh(MissionLeg, now) is not None:
            return FlownMission(held.items, seq, self.progress.progress)
        # Reading a long list leaves too little time for polls: it still flies to that item.
        is_held = vehicle.fresh(MissionLeg, now, _SILENT_S) is not None
        return FlownMission(held.items, seq if is_held else 0)

    def _follow_state(self, now: float) -> None:
        """Send a heartbeat as soon as something in it has changed; report the failsafe."""
        state = self._session.vehicle.last(FlightState)
        if state is None:
            return
        announced, was_failsafe = self._announced, self._announced is not None and self._announced[2]
        mode = self._session.vehicle.last(Mode)
        shown = None if mode is None else mode.mode
        self._announced = state.armed, shown, state.is_failsafe, self.readiness.state.is_lost
        if self._announced == announced:
            return
        if state.is_failsafe and not was_failsafe:
            self._ground.say(sentences.FAILSAFE())
        elif was_failsafe and not state.is_failsafe and state.armed:
            self._ground.say(sentences.FAILSAFE_ENDED())
        self._ground.outbox.multicast(pack(make.heartbeat(self._moment(now))), self._ground.everyone)

    def _beat(self, now: float, stations: Sequence[GroundStation]) -> None:
        moment = self._moment(now)
        heartbeat = for_qgc = make.heartbeat(moment)
        if self.readiness.state.is_lost and self._session.vehicle.armed:
            # An armed craft in CRITICAL is "Flying" there (APMFirmwarePlugin::_handleIncomingHeartbeat).
            for_qgc = make.heartbeat(moment)
            for_qgc.system_status = messages.MAV_STATE_STANDBY
        self._ground.outbox.beat(heartbeat, for_qgc, self._ground.ids, stations)

    def _follow_mission(self, now: float) -> None:
        """Report reached waypoints and the next one at once, and why a flight has stopped."""
        leg = self._session.vehicle.last(MissionLeg)
        if leg is None:
            return
        if isinstance(leg.report, FlightReport) and leg.report.summary != self._summary:
            self._summary = leg.report.summary
            boot_ms = self._moment(now).boot_ms
            self._ground.broadcast(messages.MAVLink_named_value_int_message(boot_ms, SUMMARY.encode(), self._summary))
        if isinstance(leg.report, FlightReport) and leg.report.why != self._said_why:
            self._said_why = leg.report.why
            if self._said_why is not None:
                self._ground.say(self._said_why)
        if isinstance(leg.report, NavStatus):
            was_emergency, self._is_emergency = self._is_emergency, leg.report.state == NavState.EMERGENCY_LANDING
            if self._is_emergency and not was_emergency and self._session.vehicle.armed:
                self._ground.say(sentences.EMERGENCY_LANDING())
            if why := self._missions.stopped(leg.report):
                self._ground.say(sentences.LEFT_MISSION(why))
        if self._missions.on_board is None:
            # Until the list is read, no record has an item.
            return
        before = self.progress.number, self.progress.progress
        reached = self.progress.take(leg.report)
        everyone = self._ground.everyone
        if before != (self.progress.number, self.progress.progress):
            self._send_current(everyone, now)
        asked, self._asked_current = self._asked_current, []
        for sender in asked:
            self.send_once(sender, messages.MAVLINK_MSG_ID_MISSION_CURRENT, now)
        for seq in filter(None, map(self._missions.seq_of, reached)):
            for sent_seqs, stations in self._by_item_numbers(everyone):
                number = (sent_seqs[seq] or 0) if sent_seqs else seq
                self._ground.outbox.multicast(pack(messages.MAVLink_mission_item_reached_message(number)), stations)

    def _send_current(self, receivers: Sequence[GroundStation], now: float) -> None:
        if self._session.vehicle.armed and self._session.state.controller is None:
            # Lost: it still flies to the item last reported, as far as is known.
            return
        for sent_seqs, stations in self._by_item_numbers(receivers):
            self._ground.outbox.multicast(pack(make.mission_current(self._moment(now, sent_seqs))), stations)

    def _by_item_numbers(self, stations: Sequence[GroundStation]) -> Iterable[tuple[SentSeqs, Sequence[GroundStation]]]:
        """The stations that count the items alike."""
        held = self._missions.on_board
        if held is None or not held.sent_seqs:
            return [((), stations)]
        alike: dict[SentSeqs, list[GroundStation]] = {}
        for station in stations:
            alike.setdefault(self.sent_seqs(station), []).append(station)
        return alike.items()

    def sent_seqs(self, station: GroundStation) -> SentSeqs:
        """The station's numbers of the list on board."""
        held = self._missions.on_board
        if held is None or not held.sent_seqs:
            return ()
        known = (held.sent_seqs.get(sender.identity) for sender in station.senders.values())
        return next(filter(None, known), ())

    def _announce_home(self, now: float) -> None:
        """Broadcast home whenever it changes. It can also be requested at any time."""
        home = self._session.vehicle.home
        if home == self._announced_home:
            return
        for message in self._moment(now).made(make.home_position):
            self._announced_home = home
            self._ground.broadcast(message)
