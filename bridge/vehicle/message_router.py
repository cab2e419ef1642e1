# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispatches the messages of ground stations to the parts that answer them. Sans-IO."""

from collections.abc import Callable, Mapping
from functools import partial
from math import inf

from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.missions.place_lists import NO_PLACES
from bridge.settings.parameters import Parameters
from bridge.transfers.downloads import MissionDownloads
from bridge.transfers.mission_types import Transfers
from bridge.transfers.uploads import MissionUploads
from bridge.vehicle.commands import CommandService
from bridge.vehicle.own_vehicle import OwnVehicle
from bridge.voice import sentences
from bridge.voice.happening import Sentence
from protocols.mavlink.codec import decode, item_from_float_message, item_from_int_message
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mission_item import MissionItem, MissionResult

#: MISSION_ITEM.current of items outside a list: Mission Planner's "Fly to here" and "Change altitude".
_GUIDED = (2, 3)

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
#: A channel of RC_CHANNELS_OVERRIDE that is released or left alone.
_NO_OVERRIDE = (0, 0xFFFF)

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

_Handler = Callable[[Sender, Message, float], object]


class MessageRouter:
    """Passes each known message to the part that answers it.

    transfers: by MAV_MISSION_TYPE.
    """

    def __init__(
        self,
        ground: Ground,
        transfers: Mapping[int, Transfers],
        parameters: Parameters,
        commands: CommandService,
        vehicle: OwnVehicle,
    ) -> None:
        self._ground = ground
        self._vehicle = vehicle
        self._commands = commands
        self._transfers = transfers
        #: The handlers of mission messages, by the type of their lists.
        self._of_type = {kind: self._mission_handlers(each.uploads, each.downloads) for kind, each in transfers.items()}
        self.handlers: Mapping[int, _Handler] = {
            **self._of_type[m.MAV_MISSION_TYPE_MISSION],
            m.MAVLINK_MSG_ID_MISSION_SET_CURRENT: lambda s, msg, now: commands.set_current(s, msg.seq, now),
            m.MAVLINK_MSG_ID_COMMAND_LONG: lambda s, msg, now: commands.take(
                s,
                msg.command,
                (msg.param1, msg.param2, msg.param3, msg.param4, msg.param5, msg.param6, msg.param7),
                now,
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
            m.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: lambda s, msg, now: parameters.answer_file(s, msg.payload, now),
            # There are none. Without an answer Mission Planner reads nothing else for 25 s.
            m.MAVLINK_MSG_ID_LOG_REQUEST_LIST: lambda s, _msg, _now: s.to(m.MAVLink_log_entry_message(0, 0, 0, 0, 0)),
            m.MAVLINK_MSG_ID_PING: self._ping,
            m.MAVLINK_MSG_ID_TIMESYNC: self._timesync,
            m.MAVLINK_MSG_ID_SYSTEM_TIME: lambda _s, msg, now: vehicle.hear_station_time(msg.time_unix_usec / 1e6, now),
        }

    def _mission_handlers(self, uploads: MissionUploads, downloads: MissionDownloads) -> Mapping[int, _Handler]:
        return {
            m.MAVLINK_MSG_ID_MISSION_COUNT: lambda s, msg, now: uploads.count(s, msg.count, now),
            m.MAVLINK_MSG_ID_MISSION_ITEM: partial(self._item, uploads, item_from_float_message),
            m.MAVLINK_MSG_ID_MISSION_ITEM_INT: partial(self._item, uploads, item_from_int_message),
            m.MAVLINK_MSG_ID_MISSION_ACK: lambda s, msg, now: uploads.ack(s, msg.type, now),
            m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: lambda s, msg, now: uploads.clear_all(s, msg.mission_type, now),
            m.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST: lambda s, _, now: uploads.answers.partial_list(s, now),
            m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: lambda s, _, now: downloads.request_list(s, now),
            m.MAVLINK_MSG_ID_MISSION_REQUEST: lambda s, msg, now: downloads.request(s, msg.seq, now, as_int=False),
            m.MAVLINK_MSG_ID_MISSION_REQUEST_INT: lambda s, msg, now: downloads.request(s, msg.seq, now, as_int=True),
        }

    def take(self, sender: Sender, frame: MavlinkFrame, msgid: int, now: float) -> None:
        """Handle a frame for the bridge's vehicle, if it is understood and the sender has not sent too many."""
        if msgid in _TOLD:
            # A joystick sends 50 a second: they must not use up the limit for answers.
            self._tell(sender, frame, msgid)
            return
        handler = self.handlers.get(msgid)
        if handler is None or (message := decode(frame)) is None:
            return
        cost = Cost.TRANSFER if msgid in _OF_A_TRANSFER else Cost.ANSWER
        # A heartbeat is not answered: a flood of them must not use up the answers of all.
        if msgid != m.MAVLINK_MSG_ID_HEARTBEAT and not sender.station.allows(cost):
            return
        mission_type = getattr(message, "mission_type", m.MAV_MISSION_TYPE_MISSION)
        clears_all = msgid == m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL and mission_type == m.MAV_MISSION_TYPE_ALL
        if msgid in _READS or msgid in _ENDS_DOWNLOAD:
            for kind in self._transfers.values():
                if kind.uploads.answers.due < inf:
                    kind.uploads.answers.went_on(sender)
        of_type = self._transfers.get(m.MAV_MISSION_TYPE_MISSION if clears_all else mission_type)
        if of_type is not None and of_type.lists.are_stored:
            if msgid in _READS:
                of_type.uploads.reads(sender, now)
            if msgid in _ENDS_DOWNLOAD:
                of_type.downloads.forget(sender)
            # Messages about no list have the type of missions.
            (self._of_type[of_type.lists.mission_type].get(msgid) or handler)(sender, message, now)
        elif msgid != m.MAVLINK_MSG_ID_MISSION_ACK:
            if msgid == m.MAVLINK_MSG_ID_MISSION_COUNT:
                sender.say(NO_PLACES.why)
            sender.mission_ack(MissionResult.UNSUPPORTED, mission_type)
        if clears_all:
            # The one answer is the missions'.
            for number in (m.MAV_MISSION_TYPE_FENCE, m.MAV_MISSION_TYPE_RALLY):
                if self._transfers[number].lists.are_stored:
                    self._transfers[number].uploads.clear_all(sender, number, now)

    def _item(
        self,
        uploads: MissionUploads,
        convert: Callable[[Message], MissionItem],
        sender: Sender,
        message: Message,
        now: float,
    ) -> None:
        if message.current in _GUIDED and not uploads.is_writing(sender):
            self._commands.refuse(sender, m.MAV_CMD_NAV_WAYPOINT)
            sender.mission_ack(MissionResult.DENIED)
        else:
            uploads.item(sender, convert(message), now)

    def _heartbeat(self, sender: Sender, message: Message, _now: float) -> None:
        sender.station.behaviour.base_mode = message.base_mode

    def _data_stream(self, sender: Sender, message: Message, _now: float) -> None:
        rate_hz = message.req_message_rate if message.start_stop else 0
        self._vehicle.set_stream(sender.station, message.req_stream_id, 1 / rate_hz if rate_hz else inf)

    def _tell(self, sender: Sender, frame: MavlinkFrame, msgid: int) -> None:
        if msgid == m.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE:
            message = decode(frame)
            if message is None or all(getattr(message, f"chan{n}_raw") in _NO_OVERRIDE for n in range(1, 9)):
                return
        self._commands.tell(sender, _TOLD[msgid]())

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
