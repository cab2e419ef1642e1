"""Messages from frames and frames from messages, for the messages that the bridge itself reads or writes."""

import struct

from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkFrame


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
        return frame
