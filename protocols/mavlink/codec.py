# SPDX-License-Identifier: GPL-3.0-or-later
"""Decodes and encodes the messages that the bridge itself reads or writes."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from fastcrc.crc16 import mcrf4xx

from protocols.mavlink.dialect import CRC_EXTRA, MESSAGE_FORMATS, Message, messages
from protocols.mavlink.frame import MAGIC_V1, MAGIC_V2, MavlinkFrame
from protocols.mission_item import MissionItem, degrees_to_e7

_SIGNED = 0x01
_CRC_SIZE = 2
_LAST_V1_ID = 255
_PYMAVLINK = messages.MAVLink(None)
_HEADER_V1 = struct.Struct("<BBBBBB")
_ATTITUDE = struct.Struct("<Iffffff")
#: Magic, payload size, both kinds of flags, sequence number, sender's ids, message id's lower 16 and upper 8 bits.
_HEADER_V2 = struct.Struct("<BBBBBBBHB")
#: A file transfer's payload: its header, opcodes and errors (FailErrno with EOPNOTSUPP, FileNotFound).
_FTP = struct.Struct("<HBBBBBBI")
_FTP_SIZE, _FTP_OPCODE_AT, _FTP_ACK, _FTP_NAK = 251, 3, 128, 129
_FTP_OF_SESSIONS, _FTP_READS = range(3), (3, 4, 5, 14, 15)
_FTP_NOT_SUPPORTED, _FTP_NO_FILE = bytes((2, 95)), bytes((10,))


def decode(frame: MavlinkFrame) -> Message | None:
    """The message in a frame, or None if pymavlink does not know it.

    >>> heartbeat = decode(MavlinkFrame(bytes.fromhex("fe0900010100000000000203000403d014")))
    >>> heartbeat.get_type(), heartbeat.autopilot == messages.MAV_AUTOPILOT_ARDUPILOTMEGA
    ('HEARTBEAT', True)
    """
    return _PYMAVLINK.decode(bytearray(frame.raw)) if frame.msgid in messages.mavlink_map else None


class Packed(NamedTuple):
    """A payload, whole and as MAVLink 2 sends it (without trailing zeros). Receivers differ only in the header."""

    msgid: int
    payload_v1: bytes
    payload_v2: bytes

    @property
    def is_v2_only(self) -> bool:
        """True if its id does not fit MAVLink 1."""
        return self.msgid > _LAST_V1_ID


def repack(frame: MavlinkFrame) -> Packed | None:
    """A received message, to be framed with other numbers, or None if the size is not known."""
    form = MESSAGE_FORMATS.get(frame.msgid)
    if form is None:
        return None
    whole = frame.payload[: form.base_size].ljust(form.base_size or 0, b"\0")
    return Packed(frame.msgid, whole, frame.payload.rstrip(b"\0") or b"\0")


def pack(message: Message) -> Packed:
    """Pack a message's fields, once for all receivers. struct.error if a value does not fit its field.

    MAVLink 1 lacks extension fields, and Mission Planner drops a frame of another size.
    """
    if isinstance(message, Packed):
        return message
    msgid: int = message.get_msgId()  # not `id`, which some messages have as a field
    values: list[object] = []
    for name, is_array in _sent_fields(msgid):
        value = getattr(message, name)
        if is_array:
            values += value
        else:
            values.append(value)
    payload: bytes = message.unpacker.pack(*values)
    return Packed(msgid, payload[: MESSAGE_FORMATS[msgid].base_size], payload.rstrip(b"\0") or b"\0")


@cache
def _sent_fields(msgid: int) -> list[tuple[str, bool]]:
    """The attributes of pymavlink's class in the order sent, and whether they are arrays.

    pymavlink's own `pack` makes a frame for one receiver, at five times the cost. A field of type char is text, with
    the bytes to send beside it.
    """
    kind = messages.mavlink_map[msgid]
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    return [
        (f"_{name}_raw", False) if types[name] == "char" else (name, count > 0)
        for name, count in zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)
    ]


# The message sent ten times a second is packed by struct.


def pack_attitude(boot_ms: int, *angles_and_rates: float) -> Packed:
    """ATTITUDE: roll, pitch and yaw, then their rates. A pymavlink object would cost as much as the frame itself."""
    payload = _ATTITUDE.pack(boot_ms, *angles_and_rates)
    return Packed(messages.MAVLINK_MSG_ID_ATTITUDE, payload, payload.rstrip(b"\0") or b"\0")


def file_refusal(payload: Sequence[int]) -> list[int] | None:
    """The reply to a FILE_TRANSFER_PROTOCOL payload: there are no files. None if it is not a request.

    https://mavlink.io/en/services/ftp.html. Mission Planner repeats a request for 70 s if its reply is another error,
    QGroundControl then requests the parameters by messages.
    """
    request = bytes(payload)
    if len(request) < _FTP.size or request[_FTP_OPCODE_AT] >= _FTP_ACK:
        return None
    seq, session, opcode = _FTP.unpack_from(request)[:3]
    error = b"" if opcode in _FTP_OF_SESSIONS else _FTP_NO_FILE if opcode in _FTP_READS else _FTP_NOT_SUPPORTED
    kind = _FTP_NAK if error else _FTP_ACK
    reply = _FTP.pack((seq + 1) & 0xFFFF, session, kind, len(error), opcode, 0, 0, 0) + error
    return list(reply.ljust(_FTP_SIZE, b"\0"))


class FrameWriter:
    r"""Makes the frames of one sender to one receiver.

    >>> text = messages.MAVLink_statustext_message(messages.MAV_SEVERITY_INFO, b"Mission stored")
    >>> FrameWriter(1, 1).frame(pack(text), 2)
    b'\xfd\x0f\x00\x00\x00\x01\x01\xfd\x00\x00\x06Mission storedlX'

    Each receiver has its own sequence numbers: ground stations show gaps as a bad link. `sign` returns the
    signature of a MAVLink 2 frame; MAVLink 1 has none.
    """

    def __init__(self, sysid: int, compid: int, sign: Callable[[bytes], bytes] | None = None) -> None:
        self._sysid = sysid
        self._compid = compid
        self._sign = sign
        self._seq = 0

    def frame(self, packed: Packed, version: int) -> bytes:
        """A frame of MAVLink 1 or 2. Always 2 if MAVLink 1 lacks the message."""
        seq, self._seq = self._seq, (self._seq + 1) & 0xFF
        msgid = packed.msgid
        if version == 1 and not packed.is_v2_only:
            payload, sign = packed.payload_v1, None
            header = _HEADER_V1.pack(MAGIC_V1, len(payload), seq, self._sysid, self._compid, msgid)
        else:
            payload, sign = packed.payload_v2, self._sign
            flags, low, high = 0 if sign is None else _SIGNED, msgid & 0xFFFF, msgid >> 16
            header = _HEADER_V2.pack(MAGIC_V2, len(payload), flags, 0, seq, self._sysid, self._compid, low, high)
        frame = header + payload
        frame += mcrf4xx(frame[1:] + CRC_EXTRA[msgid]).to_bytes(_CRC_SIZE, "little")
        return frame if sign is None else frame + sign(frame)


# Mission items (https://mavlink.io/en/services/mission.html).


def item_from_float_message(message: Message) -> MissionItem:
    """Read MISSION_ITEM: the coordinates are float degrees."""
    return replace(item_from_int_message(message), lat_e7=degrees_to_e7(message.x), lon_e7=degrees_to_e7(message.y))


def item_from_int_message(message: Message) -> MissionItem:
    """Read MISSION_ITEM_INT: the coordinates are exact."""
    params = (message.param1, message.param2, message.param3, message.param4)
    return MissionItem(message.seq, message.command, message.frame, *params, message.x, message.y, message.z)


def item_message(item: MissionItem, sysid: int, compid: int, mission_type: int = 0, *, as_int: bool) -> Message:
    """Make the message for one item, addressed to a ground station."""
    lat_e7, lon_e7 = item.lat_e7 or 0, item.lon_e7 or 0
    head = (sysid, compid, item.seq, item.frame, item.command, 0, 1, item.p1, item.p2, item.p3, item.p4)
    if as_int:
        return messages.MAVLink_mission_item_int_message(*head, lat_e7, lon_e7, item.alt_m, mission_type)
    return messages.MAVLink_mission_item_message(*head, lat_e7 / 1e7, lon_e7 / 1e7, item.alt_m, mission_type)
