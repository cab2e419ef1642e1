# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames from ground stations: checked, then passed to the part that answers them, or on to an autopilot. Sans-IO."""

from collections import Counter
from collections.abc import Callable, Mapping
from itertools import product
from math import inf

from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation, Sender
from bridge.gcs.rights import FrameRefusal
from bridge.gcs.routes import Routes
from bridge.gcs.station import Peer
from bridge.missions.place_lists import NO_PLACES
from bridge.model.events import Emit, GcsRefused
from bridge.settings.parameters import Parameters
from bridge.transfers.mission_types import ENDS_DOWNLOAD, GUIDED, READS, Transfers
from bridge.transfers.uploads import Handler
from bridge.vehicle.commands import CommandService
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.voice import sentences
from bridge.voice.happening import Sentence
from protocols.mavlink.codec import FrameWriter, decode, file_refusal
from protocols.mavlink.dialect import MESSAGE_FORMATS, CommandResult, Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionResult
from protocols.rights import Effect
from protocols.rights.mavlink import effect_of

#: The reason why the frames of such a sender are ignored.
OWN_IDS = "sent with the vehicle's own sysid and compid"


#: Messages of other buttons, which are not acknowledged.
_TOLD: Mapping[int, Sentence[()]] = {
    m.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE: sentences.JOYSTICK,
    m.MAVLINK_MSG_ID_MANUAL_CONTROL: sentences.JOYSTICK,
    m.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN: sentences.ORIGIN,
    m.MAVLINK_MSG_ID_SET_HOME_POSITION: sentences.HOME,
    m.MAVLINK_MSG_ID_MOUNT_CONTROL: sentences.NO_CAMERA,
    m.MAVLINK_MSG_ID_DIGICAM_CONTROL: sentences.NO_CAMERA,
    m.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_PITCHYAW: sentences.NO_CAMERA,
    m.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: sentences.FLY,
}

#: Messages of a mission transfer: hundreds a second over a fast link. All others are rare.
_ITEMS = frozenset({m.MAVLINK_MSG_ID_MISSION_ITEM, m.MAVLINK_MSG_ID_MISSION_ITEM_INT})
_OF_A_TRANSFER = _ITEMS | {
    m.MAVLINK_MSG_ID_MISSION_COUNT,
    m.MAVLINK_MSG_ID_MISSION_REQUEST,
    m.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
    m.MAVLINK_MSG_ID_MISSION_ACK,
}


class Incoming:
    """Checks, counts, and answers or passes on every frame from a ground station.

    Refusals are logged once for each station and reason; bridge/gcs/rights.py has their policy. `routes` is set while
    an autopilot that represents itself is on the line. Frames then go to it unchanged.
    """

    def __init__(
        self,
        ground: Ground,
        transfers: Mapping[int, Transfers],
        parameters: Parameters,
        commands: CommandService,
        vehicle: OwnVehicle,
        send_to_autopilot: Callable[[bytes], None],
        sysid: int,
        compid: int,
        emit: Emit,
    ) -> None:
        self._ground = ground
        self._parameters = parameters
        self._send_to_autopilot = send_to_autopilot
        self._ids = sysid, compid
        self._emit = emit
        self._our_targets = frozenset(product((0, sysid), (0, compid)))
        self.routes: Routes | None = None
        #: Refusals by (link, reason).
        self.refused: Counter[tuple[str, str]] = Counter()
        self._vehicle = vehicle
        self._commands = commands
        self._transfers = transfers
        self._handlers: Mapping[int, Handler] = {
            **transfers[m.MAV_MISSION_TYPE_MISSION].handlers,
            m.MAVLINK_MSG_ID_MISSION_SET_CURRENT: lambda s, msg, now: commands.set_current(s, msg.seq, now),
            m.MAVLINK_MSG_ID_COMMAND_LONG: lambda s, msg, now: commands.take(
                s, msg.command, [getattr(msg, f"param{number}") for number in range(1, 8)], now
            ),
            m.MAVLINK_MSG_ID_COMMAND_INT: lambda s, msg, now: commands.take(
                s, msg.command, (msg.param1, msg.param2, msg.param3, msg.param4, msg.x, msg.y, msg.z), now
            ),
            m.MAVLINK_MSG_ID_HEARTBEAT: self._heartbeat,
            m.MAVLINK_MSG_ID_REQUEST_DATA_STREAM: self._data_stream,
            m.MAVLINK_MSG_ID_SET_MODE: lambda s, msg, _: commands.refuse(
                s, m.MAV_CMD_DO_SET_MODE, (msg.base_mode, msg.custom_mode)
            ),
            m.MAVLINK_MSG_ID_AUTOPILOT_VERSION_REQUEST: lambda s, _msg, now: vehicle.send_once(
                s, m.MAVLINK_MSG_ID_AUTOPILOT_VERSION, now
            ),
            m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: lambda s, _msg, now: parameters.request_list(s, now),
            m.MAVLINK_MSG_ID_PARAM_REQUEST_READ: lambda s, msg, now: parameters.send_one(
                s, msg.param_id, msg.param_index, now
            ),
            m.MAVLINK_MSG_ID_PARAM_SET: lambda s, msg, now: parameters.set(s, msg.param_id, msg.param_value, now),
            m.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: self._refuse_file,
            # There are none. Without an answer Mission Planner waits for 25 s.
            m.MAVLINK_MSG_ID_LOG_REQUEST_LIST: lambda s, _msg, _now: s.to(m.MAVLink_log_entry_message(0, 0, 0, 0, 0)),
            m.MAVLINK_MSG_ID_PING: self._ping,
            m.MAVLINK_MSG_ID_TIMESYNC: self._timesync,
            m.MAVLINK_MSG_ID_SYSTEM_TIME: lambda _s, msg, now: vehicle.hear_station_time(msg.time_unix_usec / 1e6, now),
        }

    def received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> bool:
        """Handle bytes from a ground station. Returns False if they are dropped. A datagram holds whole frames only."""
        received = self._ground.received(peer, data, now, datagram=datagram)
        if received is None:
            return False
        station, frames = received
        for frame in frames:
            ids, target, msgid = frame.sender, frame.target, frame.msgid
            if ids == self._ids:
                # Own frames, which lack such a target, come back from a broadcast, or from a router that floods.
                if target[0] == ids[0]:
                    self._ignore(OWN_IDS, station, frame)
                continue
            effect = effect_of(frame)
            refused = station.refusal(frame, effect)
            if refused is not None:
                self.refused[peer.link, refused.why] += 1
                if refused.is_forged:
                    self._report(refused, station, frame)
                    continue
            if not (station.is_heard or self._ground.admits(station, now)):
                return False
            sender = self._ground.heard(station, frame, ids, now)
            if sender is None:
                continue  # not proven yet; if it never answers, a text says why
            if refused is not None:
                self._answer_refused(refused, sender, frame)
            elif self.routes is not None:
                self._pass_on(self.routes, sender, frame, effect)
            else:
                if self._ground.outbox.recorded is not None:
                    self._record(station, frame)
                if target in self._our_targets:
                    self._take(sender, frame, msgid, now)
                elif target[0] == self._ids[0]:
                    why = f"addressed to component {target[1]} instead of {self._ids[1]}"
                    self._ignore(why, station, frame)
        return True

    def _ignore(self, why: str, station: GroundStation, frame: MavlinkFrame) -> None:
        """Count and report a frame that does not get an answer."""
        self.refused[station.peer.link, why] += 1
        # A station that is not heard is forgotten with each datagram.
        if station.is_heard or self.refused[station.peer.link, why] == 1:
            self._report(FrameRefusal(why, is_routine=False), station, frame)

    def _record(self, station: GroundStation, frame: MavlinkFrame) -> None:
        recorded = self._ground.outbox.recorded
        if recorded is not None and not station.is_listener and station.allows(Cost.RECORDED):
            recorded.append(frame.raw)

    def _pass_on(self, routes: Routes, sender: Sender, frame: MavlinkFrame, effect: Effect) -> None:
        """Forward a frame to the targets, within the sender's rights."""
        station = sender.station
        if not station.allows(Cost.PASSED) or routes.is_echo(frame):
            return
        to_stations = effect in station.rights.stations
        is_for_autopilot = routes.from_station(station, frame, to_stations=to_stations)
        if is_for_autopilot or not to_stations:
            refused = station.passing_refusal(effect)
            if refused is not None:
                if not station.is_listener:
                    self.refused[station.peer.link, refused.why] += 1
                self._answer_refused(refused, sender, frame)
                return
        self._record(station, frame)
        if is_for_autopilot:
            self._send_to_autopilot(frame.raw)

    def _answer_refused(self, refused: FrameRefusal, sender: Sender, frame: MavlinkFrame) -> None:
        """Answer a refused frame under the ids that it addressed, if these are the vehicle's."""
        station = sender.station
        self._report(refused, station, frame)
        writer = None
        is_vehicle = frame.target in self._our_targets
        if self.routes is not None:
            asked = self.routes.addressed(*frame.target)
            is_vehicle = asked is not None
            writer = None if asked is None else FrameWriter(*asked, station.sign)
        if not (is_vehicle and station.allows(Cost.ANSWER)):
            return
        message = decode(frame)
        answer = None if message is None else _denial(message, sender)
        if answer is not None:
            self._ground.outbox.send(station, [answer], writer)
        elif message is not None and frame.msgid == m.MAVLINK_MSG_ID_PARAM_SET and self.routes is None:
            self._parameters.refuse(sender, message.param_id)
        why, now = sentences.FRAME_REFUSED(refused.why), station.heard_at
        is_new = not refused.is_routine and not station.bad_news.is_repeated(why, now, is_routine=False)
        if is_new and station.allows(Cost.TEXT):
            text = m.MAVLink_statustext_message(why.severity, why.line.encode())
            self._ground.outbox.send(station, [text], writer)

    def _report(self, refused: FrameRefusal, station: GroundStation, frame: MavlinkFrame) -> None:
        """Log a connected station's refusal once for each reason."""
        if refused.is_routine or refused.why in station.reported:
            return
        station.reported.add(refused.why)
        known = MESSAGE_FORMATS.get(frame.msgid)
        name = "{} sysid {} compid {}".format(station.peer, *frame.sender)
        message = str(frame.msgid if known is None else known.name)
        self._emit(GcsRefused(station=name, message=message, why=refused.why))

    # Messages for the vehicle.

    def _take(self, sender: Sender, frame: MavlinkFrame, msgid: int, now: float) -> None:
        """Handle a frame for the bridge's vehicle, if it is understood and the sender has not sent too many."""
        if msgid in _TOLD:
            # A joystick sends 50 a second: they must not use up the limit for answers.
            self._commands.tell(sender, _TOLD[msgid]())
            return
        handler = self._handlers.get(msgid)
        if handler is None or (message := decode(frame)) is None:
            return
        cost = Cost.TRANSFER if msgid in _OF_A_TRANSFER else Cost.ANSWER
        # A heartbeat is not answered: a flood of them must not use up the answers of all.
        if msgid != m.MAVLINK_MSG_ID_HEARTBEAT and not sender.station.allows(cost):
            return
        mission_type = getattr(message, "mission_type", m.MAV_MISSION_TYPE_MISSION)
        clears_all = msgid == m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL and mission_type == m.MAV_MISSION_TYPE_ALL
        if msgid in READS or msgid in ENDS_DOWNLOAD:
            for kind in self._transfers.values():
                if kind.uploads.answers.due < inf:
                    kind.uploads.answers.went_on(sender)
        of_type = self._transfers.get(m.MAV_MISSION_TYPE_MISSION if clears_all else mission_type)
        if of_type is not None and of_type.lists.are_stored:
            if msgid in READS:
                of_type.uploads.reads(sender, now)
            if msgid in ENDS_DOWNLOAD:
                of_type.downloads.forget(sender)
            if msgid in _ITEMS and message.current in GUIDED and not of_type.uploads.is_writing(sender):
                self._commands.refuse(sender, m.MAV_CMD_NAV_WAYPOINT)
                sender.mission_ack(MissionResult.DENIED)
            else:
                # A message without a mission_type (a command, a heartbeat) has the type of missions.
                (of_type.handlers.get(msgid) or handler)(sender, message, now)
        elif msgid == m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST and of_type is not None:
            # Mission Planner ignores a refusal, and times out after 5 s.
            sender.say(sentences.ONLY_MISSIONS())
            sender.to(m.MAVLink_mission_count_message(sender.sysid, sender.compid, 0, mission_type))
        elif msgid != m.MAVLINK_MSG_ID_MISSION_ACK:
            if msgid == m.MAVLINK_MSG_ID_MISSION_COUNT:
                sender.say(NO_PLACES.why)
            sender.mission_ack(MissionResult.UNSUPPORTED, mission_type)
        if clears_all:
            # The one answer is the missions'.
            for number in (m.MAV_MISSION_TYPE_FENCE, m.MAV_MISSION_TYPE_RALLY):
                if self._transfers[number].lists.are_stored:
                    self._transfers[number].uploads.clear_all(sender, number, now)

    def _refuse_file(self, sender: Sender, message: Message, _now: float) -> None:
        if (answer := _denial(message, sender)) is not None:
            sender.to(answer)

    def _heartbeat(self, sender: Sender, message: Message, _now: float) -> None:
        sender.station.behaviour.base_mode = message.base_mode

    def _data_stream(self, sender: Sender, message: Message, _now: float) -> None:
        rate_hz = message.req_message_rate if message.start_stop else 0
        self._vehicle.set_stream(sender.station, message.req_stream_id, 1 / rate_hz if rate_hz else inf)

    def _ping(self, sender: Sender, message: Message, _now: float) -> None:
        if message.target_system != 0:
            sender.station.bad_news.answered(message.time_usec)
        else:
            answer = m.MAVLink_ping_message(message.time_usec, message.seq, sender.sysid, sender.compid)
            sender.to(answer)

    def _timesync(self, sender: Sender, message: Message, now: float) -> None:
        if message.tc1 != 0:
            sender.station.bad_news.answered(message.ts1)
        else:
            sender.to(m.MAVLink_timesync_message(int(now * 1e9), message.ts1))


def _denial(message: Message, sender: Sender) -> Message | None:
    """The protocol's own negative reply to a refused message, if there is one."""
    match message.get_type():
        case "COMMAND_LONG" | "COMMAND_INT":
            denied = CommandResult.DENIED
            return m.MAVLink_command_ack_message(message.command, denied, 0, 0, sender.sysid, sender.compid)
        case "MISSION_COUNT" | "MISSION_ITEM" | "MISSION_ITEM_INT" | "MISSION_CLEAR_ALL" | "MISSION_WRITE_PARTIAL_LIST":
            denied_mission = MissionResult.DENIED
            return m.MAVLink_mission_ack_message(sender.sysid, sender.compid, denied_mission, message.mission_type)
        case "FILE_TRANSFER_PROTOCOL":
            payload = file_refusal(message.payload)
            if payload is not None:
                return m.MAVLink_file_transfer_protocol_message(0, sender.sysid, sender.compid, payload)
    return None
