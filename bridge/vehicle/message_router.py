# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames from ground stations: guarded, then dispatched by a table, or passed on to an autopilot. Sans-IO."""

from collections.abc import Callable
from functools import partial
from math import inf

from bridge.gcs.cost import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.guard import Guard, GuardRefusal, denial
from bridge.gcs.routes import Routes
from bridge.gcs.station import Peer, Severity, Station
from bridge.transfers.downloads import MissionDownloads
from bridge.transfers.uploads import MissionUploads
from bridge.vehicle.commands import CommandService
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.vehicle.parameters import Parameters
from protocols.mavlink.codec import MavlinkDecoder
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.ftp import refuse
from protocols.mavlink.mission_messages import item_from_float_message, item_from_int_message
from protocols.mavlink.target import target_of
from protocols.mission_item import MissionItem, MissionResult

#: MISSION_ITEM.current of items outside a list: Mission Planner's "Fly to here" and "Change altitude".
_GUIDED = (2, 3)

#: Messages of a mission transfer: hundreds a second over a fast link. All others are rare.
_OF_A_TRANSFER = frozenset(
    {
        m.MAVLINK_MSG_ID_MISSION_COUNT,
        m.MAVLINK_MSG_ID_MISSION_ITEM,
        m.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        m.MAVLINK_MSG_ID_MISSION_REQUEST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        m.MAVLINK_MSG_ID_MISSION_ACK,
    }
)

_ENDS_DOWNLOAD = frozenset(
    {m.MAVLINK_MSG_ID_MISSION_COUNT, m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL, m.MAVLINK_MSG_ID_MISSION_ACK}
)

_READS = frozenset(
    {
        m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
    }
)

_Handler = Callable[[Station, Message, float], object]


class MessageRouter:
    """Passes each known message to the part that answers it."""

    def __init__(
        self,
        ground: Ground,
        uploads: MissionUploads,
        downloads: MissionDownloads,
        parameters: Parameters,
        commands: CommandService,
        vehicle: OwnVehicle,
    ) -> None:
        self._ground = ground
        self._vehicle = vehicle
        self._commands = commands
        self._uploads = uploads
        self._downloads = downloads
        self._handlers: dict[int, _Handler] = {
            m.MAVLINK_MSG_ID_MISSION_COUNT: lambda s, msg, now: uploads.count(s, msg.count, now),
            m.MAVLINK_MSG_ID_MISSION_ITEM: lambda s, msg, now: self._item(s, msg, item_from_float_message(msg), now),
            m.MAVLINK_MSG_ID_MISSION_ITEM_INT: lambda s, msg, now: self._item(s, msg, item_from_int_message(msg), now),
            m.MAVLINK_MSG_ID_MISSION_ACK: lambda s, msg, now: uploads.ack(s, msg.type, now),
            m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: lambda s, msg, now: uploads.clear_all(s, msg.mission_type, now),
            m.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST: lambda s, _, now: uploads.answers.partial_list(s, now),
            m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: lambda s, _, now: downloads.request_list(s, now),
            m.MAVLINK_MSG_ID_MISSION_REQUEST: lambda s, msg, now: downloads.request(s, msg.seq, now, as_int=False),
            m.MAVLINK_MSG_ID_MISSION_REQUEST_INT: lambda s, msg, now: downloads.request(s, msg.seq, now, as_int=True),
            m.MAVLINK_MSG_ID_MISSION_SET_CURRENT: self._set_current,
            m.MAVLINK_MSG_ID_COMMAND_LONG: lambda s, msg, now: commands.take(
                s,
                msg.command,
                (msg.param1, msg.param2, msg.param3, msg.param4, msg.param5, msg.param6, msg.param7),
                now,
            ),
            m.MAVLINK_MSG_ID_COMMAND_INT: lambda s, msg, now: commands.take(
                s, msg.command, (msg.param1, msg.param2, msg.param3, msg.param4, msg.x, msg.y, msg.z), now
            ),
            m.MAVLINK_MSG_ID_REQUEST_DATA_STREAM: self._data_stream,
            m.MAVLINK_MSG_ID_SET_MODE: lambda s, _msg, _now: commands.refuse(s, m.MAV_CMD_DO_SET_MODE),
            m.MAVLINK_MSG_ID_AUTOPILOT_VERSION_REQUEST: lambda s, _msg, _now: vehicle.send_once(
                s, m.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            ),
            m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: lambda s, _msg, _now: parameters.send_all(s),
            m.MAVLINK_MSG_ID_PARAM_REQUEST_READ: lambda s, msg, _: parameters.send_one(
                s, msg.param_id, msg.param_index
            ),
            m.MAVLINK_MSG_ID_PARAM_SET: lambda s, msg, now: parameters.set(s, msg.param_id, msg.param_value, now),
            m.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: self._ftp,
            # There are none. Without an answer Mission Planner reads nothing else for 25 s.
            m.MAVLINK_MSG_ID_LOG_REQUEST_LIST: lambda s, _msg, _now: ground.to(
                s, m.MAVLink_log_entry_message(0, 0, 0, 0, 0)
            ),
            m.MAVLINK_MSG_ID_PING: self._ping,
            m.MAVLINK_MSG_ID_TIMESYNC: self._timesync,
        }

    def understands(self, msgid: int) -> bool:
        return msgid in self._handlers

    def take(self, station: Station, message: Message, now: float) -> None:
        """Handle a message for which `understands` is True, unless its sender exceeds its limit."""
        msgid = message.get_msgId()
        if not self._ground.allows(station, Cost.TRANSFER if msgid in _OF_A_TRANSFER else Cost.ANSWER):
            return
        mission_type = getattr(message, "mission_type", m.MAV_MISSION_TYPE_MISSION)
        clears_all = msgid == m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL and mission_type == m.MAV_MISSION_TYPE_ALL
        if msgid in _READS or msgid in _ENDS_DOWNLOAD:
            self._uploads.answers.went_on(station)
        if mission_type == m.MAV_MISSION_TYPE_MISSION or clears_all:
            if msgid in _READS:
                self._uploads.reads(station, now)
            if msgid in _ENDS_DOWNLOAD:
                self._downloads.forget(station)
            self._handlers[msgid](station, message, now)
        elif msgid != m.MAVLINK_MSG_ID_MISSION_ACK:
            if msgid == m.MAVLINK_MSG_ID_MISSION_COUNT:
                self._ground.say(Severity.ERROR, "No fences or rally points: only missions are stored", station)
            self._ground.mission_ack(station, MissionResult.UNSUPPORTED, mission_type)

    def _item(self, station: Station, message: Message, item: MissionItem, now: float) -> None:
        if message.current in _GUIDED and not self._uploads.is_writing(station):
            self._commands.refuse(station, m.MAV_CMD_NAV_WAYPOINT)
            self._ground.mission_ack(station, MissionResult.DENIED)
        else:
            self._uploads.item(station, item, now)

    def _set_current(self, station: Station, _message: Message, now: float) -> None:
        self._commands.refuse(station, m.MAV_CMD_DO_SET_MISSION_CURRENT)
        self._vehicle.refuse_current(station, now)

    def _data_stream(self, station: Station, message: Message, _now: float) -> None:
        rate_hz = message.req_message_rate if message.start_stop else 0
        self._vehicle.set_stream(station.peer, message.req_stream_id, 1 / rate_hz if rate_hz else inf)

    def _ftp(self, station: Station, message: Message, _now: float) -> None:
        answer = refuse(message.payload)
        if answer is not None:
            self._ground.to(station, m.MAVLink_file_transfer_protocol_message(0, station.sysid, station.compid, answer))

    def _ping(self, station: Station, message: Message, _now: float) -> None:
        # A PING with targets is itself an answer.
        if message.target_system == 0:
            answer = m.MAVLink_ping_message(message.time_usec, message.seq, station.sysid, station.compid)
            self._ground.to(station, answer)

    def _timesync(self, station: Station, message: Message, now: float) -> None:
        if message.tc1 == 0:
            self._ground.to(station, m.MAVLink_timesync_message(int(now * 1e9), message.ts1))


class Incoming:
    """Guards, counts, and answers or passes on every frame from a ground station.

    `routes` is set while an autopilot that represents itself is on the line; frames then go to it unchanged.
    """

    def __init__(
        self,
        guard: Guard,
        ground: Ground,
        router: MessageRouter,
        parameters: Parameters,
        send_to_autopilot: Callable[[bytes], None],
        sysid: int,
        compid: int,
    ) -> None:
        self._guard = guard
        self._ground = ground
        self._router = router
        self._parameters = parameters
        self._send_to_autopilot = send_to_autopilot
        self._ids = sysid, compid
        self._decoder = MavlinkDecoder()
        self.routes: Routes | None = None

    def received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> bool:
        """Handle bytes from a ground station; False if they are dropped. A datagram holds whole frames only."""
        if not self._ground.budgets.allows(Cost.RECEIVED, peer, now):
            return False
        for frame in self._ground.received(peer, data, now, datagram=datagram):
            refused = self._guard.refusal(peer, frame)
            if refused is not None and refused.is_forged:
                self._guard.report(refused, peer, frame)
                continue
            if not self._ground.admits(peer, now):
                self._guard.forget(peer)
                return False
            self._ground.heard(peer, frame, now)
            station = Station(peer, frame.sysid, frame.compid)
            if refused is not None:
                self._answer_refused(refused, station, frame)
            elif self.routes is not None:
                self._pass_on(self.routes, station, frame, now)
            else:
                self._ground.record(peer, frame, now)
                if self._router.understands(frame.msgid) and self._is_ours(*target_of(frame)):
                    message = self._decoder.decode(frame)
                    if message is not None:
                        self._router.take(station, message, now)
        return True

    def forget(self, peer: Peer) -> None:
        self._guard.forget(peer)
        if self.routes is not None:
            self.routes.forget(peer)

    def _pass_on(self, routes: Routes, station: Station, frame: MavlinkFrame, now: float) -> None:
        """Send a frame on to its targets, within its sender's rights."""
        peer = station.peer
        if not self._ground.budgets.allows(Cost.PASSED, peer, now):
            return
        if routes.is_echo(frame):
            return
        to_stations = self._guard.may_reach_stations(peer, frame)
        is_for_autopilot = routes.from_station(station, frame, to_stations=to_stations)
        if is_for_autopilot or not to_stations:
            refused = self._guard.passing_refusal(peer, frame)
            if refused is not None:
                self._answer_refused(refused, station, frame)
                return
        self._ground.record(peer, frame, now)
        if is_for_autopilot:
            self._send_to_autopilot(frame.raw)

    def _answer_refused(self, refused: GuardRefusal, station: Station, frame: MavlinkFrame) -> None:
        """Answer a refused frame under the ids that it addressed, if these are the vehicle's."""
        is_first = self._guard.report(refused, station.peer, frame)
        system, component = target_of(frame)
        answers = partial(self._ground.to, station)
        is_vehicle = self._is_ours(system, component)
        if self.routes is not None:
            asked = self.routes.addressed(system, component)
            is_vehicle = asked is not None
            if asked is not None:
                answers = partial(self._ground.to_as, asked, station)
        if not (is_vehicle and self._ground.allows(station, Cost.ANSWER)):
            return
        message = self._decoder.decode(frame)
        answer = None if message is None else denial(message, station)
        if answer is not None:
            answers(answer)
        elif message is not None and frame.msgid == m.MAVLINK_MSG_ID_PARAM_SET and self.routes is None:
            # The protocol's answer is the current value.
            self._parameters.send_one(station, message.param_id, -1)
        if is_first:
            answers(m.MAVLink_statustext_message(Severity.WARNING, f"Refused: {refused.why}".encode()))

    def _is_ours(self, system: int, component: int) -> bool:
        sysid, compid = self._ids
        return system in (0, sysid) and component in (0, compid)
