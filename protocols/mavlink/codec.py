"""Messages from frames and frames from messages, for the messages that the bridge itself reads or writes."""

import struct

from fastcrc.crc16 import mcrf4xx

from protocols.mavlink.dialect import CRC_EXTRA, Message, messages
from protocols.mavlink.frame import MAGIC_V1, MavlinkFrame

_HEADER_V1 = 6
_CRC_SIZE = 2
#: MAVLink 1 has no extension fields, and Mission Planner drops a frame of another size; pymavlink packs them all the
#: same. The sizes of those payloads that we send and that have extensions in MAVLink 2.
_V1_PAYLOAD_SIZES = {
    messages.MAVLINK_MSG_ID_SYS_STATUS: 31,
    messages.MAVLINK_MSG_ID_GPS_RAW_INT: 30,
    messages.MAVLINK_MSG_ID_MISSION_ITEM: 37,
    messages.MAVLINK_MSG_ID_MISSION_REQUEST: 4,
    messages.MAVLINK_MSG_ID_MISSION_CURRENT: 2,
    messages.MAVLINK_MSG_ID_MISSION_COUNT: 4,
    messages.MAVLINK_MSG_ID_MISSION_ACK: 3,
    messages.MAVLINK_MSG_ID_MISSION_ITEM_INT: 37,
    messages.MAVLINK_MSG_ID_COMMAND_ACK: 3,
    messages.MAVLINK_MSG_ID_AUTOPILOT_VERSION: 60,
    messages.MAVLINK_MSG_ID_HOME_POSITION: 52,
    messages.MAVLINK_MSG_ID_STATUSTEXT: 51,
}


class MavlinkDecoder:
    """Turns checked frames into pymavlink messages. Bad content is counted, never raised."""

    def __init__(self) -> None:
        self._mavlink = messages.MAVLink(None)
        self.undecodable = 0

    def decode(self, frame: MavlinkFrame) -> Message | None:
        """Decode a frame; None if its length does not fit its message."""
        try:
            return self._mavlink.decode(bytearray(frame.raw))
        except (messages.MAVError, struct.error, UnicodeDecodeError):
            self.undecodable += 1
            return None


class MavlinkEncoder:
    """Packs messages as one sender: sysid, compid and a running sequence number."""

    def __init__(self, sysid: int, compid: int) -> None:
        self._mavlink = messages.MAVLink(None, srcSystem=sysid, srcComponent=compid)

    def encode(self, message: Message, version: int) -> bytes:
        """Pack a message as a frame of MAVLink 1 or 2."""
        frame: bytes = bytes(message.pack(self._mavlink, force_mavlink1=version == 1))
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        return _without_extensions(frame, message.get_msgId()) if version == 1 else frame


def _without_extensions(frame: bytes, msgid: int) -> bytes:
    """Cut a MAVLink 1 frame to the fields that MAVLink 1 knows."""
    size = _V1_PAYLOAD_SIZES.get(msgid)
    if size is None:
        return frame
    checked = bytes((size,)) + frame[2 : _HEADER_V1 + size]
    crc = mcrf4xx(checked + bytes((CRC_EXTRA[msgid],)))
    return bytes((MAGIC_V1,)) + checked + crc.to_bytes(_CRC_SIZE, "little")
