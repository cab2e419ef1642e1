# SPDX-License-Identifier: GPL-3.0-or-later
"""The effect of each MAVLink message on a flight controller that acts on it. docs/rights.md is generated from here.

From common.xml (https://mavlink.io/en/messages/common.html), and from ArduPilot's and PX4's handlers. A message without
a row may do anything.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.rights import Effect


@dataclass(frozen=True, slots=True)
class FieldRule:
    """An effect that depends on a field. rule: in words. judge: from the payload with its trailing zeros."""

    rule: str
    judge: Callable[[bytes], Effect]


_PAYLOAD_SIZE = 255
_FLOAT = struct.Struct("<f")
#: FTP opcodes that read, or end a session (https://mavlink.io/en/services/ftp.html). The others write files.
_FTP_READS = frozenset({0, 1, 2, 3, 4, 5, 14, 15, 128, 129})
#: The longest interval that is not called silence, us: like a stream's lowest rate.
_SLOWEST_US = 1e6


def _interval(payload: bytes) -> Effect:
    """SET_MESSAGE_INTERVAL's param2: -1 stops the message, 0 is the default rate."""
    (interval_us,) = _FLOAT.unpack_from(payload, 4)
    return Effect.RATE if 0 <= interval_us <= _SLOWEST_US else Effect.SILENCE  # also for NaN


def _stream(payload: bytes) -> Effect:
    return Effect.RATE if any(payload[0:2]) and payload[5] else Effect.SILENCE


def _command(payload: bytes) -> Effect:
    row = COMMANDS.get(int.from_bytes(payload[28:30], "little"), Effect.MOVE)
    return row if isinstance(row, Effect) else row.judge(payload)


def _item(payload: bytes) -> Effect:
    return Effect.MOVE if payload[35] > 1 else Effect.CHANGE


_OF_ITEM = FieldRule("move if current is above 1 (fly to here, change altitude), else change", _item)
_OF_COMMAND = FieldRule("by command: see below", _command)

#: Commands of COMMAND_LONG and COMMAND_INT. Any other is a MOVE.
COMMANDS: Mapping[int, Effect | FieldRule] = {
    m.MAV_CMD_GET_HOME_POSITION: Effect.READ,
    m.MAV_CMD_GET_MESSAGE_INTERVAL: Effect.READ,
    m.MAV_CMD_SET_MESSAGE_INTERVAL: FieldRule("rate if the interval is 0 to 1 s, else silence", _interval),
    m.MAV_CMD_REQUEST_MESSAGE: Effect.READ,
    m.MAV_CMD_REQUEST_PROTOCOL_VERSION: Effect.READ,
    m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: Effect.READ,
    m.MAV_CMD_REQUEST_CAMERA_INFORMATION: Effect.READ,
    m.MAV_CMD_DO_SEND_BANNER: Effect.READ,
}

#: Messages, by id. Mission Planner sends some of them before it knows that a key is needed: heartbeats, three
#: STATUSTEXTs (one signed with an empty key) and requests.
MESSAGES: Mapping[int, Effect | FieldRule] = {
    m.MAVLINK_MSG_ID_HEARTBEAT: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_SYSTEM_TIME: Effect.CHANGE,
    m.MAVLINK_MSG_ID_PING: Effect.READ,
    m.MAVLINK_MSG_ID_SET_MODE: Effect.MOVE,
    m.MAVLINK_MSG_ID_PARAM_REQUEST_READ: Effect.READ,
    m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: Effect.READ,
    m.MAVLINK_MSG_ID_PARAM_SET: Effect.CHANGE,
    m.MAVLINK_MSG_ID_MISSION_REQUEST_PARTIAL_LIST: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST: Effect.CHANGE,
    m.MAVLINK_MSG_ID_MISSION_ITEM: _OF_ITEM,
    m.MAVLINK_MSG_ID_MISSION_REQUEST: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_MISSION_SET_CURRENT: Effect.MOVE,
    m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_MISSION_COUNT: Effect.CHANGE,
    m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: Effect.CHANGE,
    # Any other result cancels a station's transfer.
    m.MAVLINK_MSG_ID_MISSION_ACK: FieldRule(
        "dialogue if it is ACCEPTED, else change", lambda payload: Effect.CHANGE if payload[2] else Effect.DIALOGUE
    ),
    m.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN: Effect.MOVE,
    m.MAVLINK_MSG_ID_MISSION_REQUEST_INT: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_REQUEST_DATA_STREAM: FieldRule("rate, or silence if it stops a stream", _stream),
    m.MAVLINK_MSG_ID_MANUAL_CONTROL: Effect.MOVE,
    m.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE: Effect.MOVE,
    m.MAVLINK_MSG_ID_MISSION_ITEM_INT: _OF_ITEM,
    m.MAVLINK_MSG_ID_COMMAND_INT: _OF_COMMAND,
    m.MAVLINK_MSG_ID_COMMAND_LONG: _OF_COMMAND,
    # It continues ArduPilot's accelerometer calibration.
    m.MAVLINK_MSG_ID_COMMAND_ACK: Effect.CHANGE,
    m.MAVLINK_MSG_ID_MANUAL_SETPOINT: Effect.MOVE,
    m.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: Effect.MOVE,
    m.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: Effect.MOVE,
    m.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: Effect.MOVE,
    m.MAVLINK_MSG_ID_HIL_STATE: Effect.MOVE,
    m.MAVLINK_MSG_ID_HIL_RC_INPUTS_RAW: Effect.MOVE,
    m.MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE: Effect.MOVE,
    m.MAVLINK_MSG_ID_HIL_SENSOR: Effect.MOVE,
    # An ArduPilot slows the telemetry down by the free space in a radio's buffer.
    m.MAVLINK_MSG_ID_RADIO_STATUS: Effect.SILENCE,
    m.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: FieldRule(
        "dialogue if it reads or ends a session, move if it writes a file (a script)",
        lambda payload: Effect.DIALOGUE if payload[6] in _FTP_READS else Effect.MOVE,
    ),
    # An answer to the autopilot's own request sets its idea of the time.
    m.MAVLINK_MSG_ID_TIMESYNC: FieldRule(
        "read, or dialogue if it is an answer", lambda payload: Effect.DIALOGUE if any(payload[0:8]) else Effect.READ
    ),
    m.MAVLINK_MSG_ID_HIL_GPS: Effect.MOVE,
    # A download takes the line's whole rate, and a second one ends the first.
    m.MAVLINK_MSG_ID_LOG_REQUEST_LIST: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_LOG_REQUEST_DATA: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_LOG_ERASE: Effect.MOVE,
    m.MAVLINK_MSG_ID_LOG_REQUEST_END: Effect.DIALOGUE,
    m.MAVLINK_MSG_ID_GPS_INJECT_DATA: Effect.MOVE,
    m.MAVLINK_MSG_ID_SERIAL_CONTROL: Effect.MOVE,
    m.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET: Effect.MOVE,
    m.MAVLINK_MSG_ID_FENCE_POINT: Effect.CHANGE,
    m.MAVLINK_MSG_ID_FENCE_FETCH_POINT: Effect.READ,
    m.MAVLINK_MSG_ID_RADIO: Effect.SILENCE,
    m.MAVLINK_MSG_ID_RALLY_POINT: Effect.CHANGE,
    m.MAVLINK_MSG_ID_RALLY_FETCH_POINT: Effect.READ,
    m.MAVLINK_MSG_ID_AUTOPILOT_VERSION_REQUEST: Effect.READ,
    m.MAVLINK_MSG_ID_GPS_INPUT: Effect.MOVE,
    m.MAVLINK_MSG_ID_GPS_RTCM_DATA: Effect.MOVE,
    m.MAVLINK_MSG_ID_SET_HOME_POSITION: Effect.MOVE,
    m.MAVLINK_MSG_ID_STATUSTEXT: Effect.READ,
    m.MAVLINK_MSG_ID_SETUP_SIGNING: Effect.KEY,
    m.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_READ: Effect.READ,
    m.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_LIST: Effect.READ,
    m.MAVLINK_MSG_ID_PARAM_EXT_SET: Effect.CHANGE,
}


def effect_of(frame: MavlinkFrame) -> Effect:
    """The effect of a frame on the vehicle that it is for."""
    row = MESSAGES.get(frame.msgid)
    if row is None:
        return Effect.UNKNOWN if frame.has_target_field else Effect.REPORT
    # MAVLink 2 omits trailing zeros.
    return row if isinstance(row, Effect) else row.judge(frame.payload.ljust(_PAYLOAD_SIZE, b"\0"))
