# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry logs (.tlog) as Mission Planner, MAVProxy and pymavlink write and replay them.

A record is 8 bytes, big-endian: microseconds since the Unix epoch, then the frame as it was on the wire.
Our logs never contain signatures, which Mission Planner could only check with the key used at the time, or
SETUP_SIGNING, which carries the key.
"""

from collections.abc import Iterable

from fastcrc.crc16 import mcrf4xx

from protocols.mavlink.dialect import CRC_EXTRA, messages
from protocols.mavlink.frame import MAGIC_V1, MavlinkFrame

_STAMP_SIZE = 8
#: pymavlink uses the two lowest bits as a link number.
_LINK_BITS = 0b11
_CRC_SIZE = 2
_SIGNATURE_SIZE = 13
_SIGNED = 0x01
#: In a MAVLink 2 header.
_MSGID = slice(7, 10)
#: In a HEARTBEAT's payload, whose largest field comes first.
_HEARTBEAT_SIZE = 9
_HEARTBEAT_TYPE = 4
_SETUP_SIGNING = messages.MAVLINK_MSG_ID_SETUP_SIGNING.to_bytes(3, "little")


def tlog_records(frames: Iterable[bytes], at_us: int) -> bytes:
    """The records of complete, valid frames of the dialect, sent or received at one time.

    Those that must not be logged are left out.
    """
    stamp = (at_us & ~_LINK_BITS).to_bytes(_STAMP_SIZE, "big")
    # No call for most frames, of which there may be thousands a second: MAVLink 1 lacks signatures and
    # SETUP_SIGNING, and in MAVLink 2 they have flags (byte 2) or an id above 255 (byte 8).
    logged = [each if each[0] == MAGIC_V1 or not (each[2] or each[8]) else _loggable(each) for each in frames]
    return b"".join([stamp + each for each in logged if each])


def heartbeat_type(frame: bytes) -> int | None:
    """The MAV_TYPE in a HEARTBEAT frame, or None for other messages."""
    found = MavlinkFrame(frame)
    if found.msgid != messages.MAVLINK_MSG_ID_HEARTBEAT:
        return None
    # MAVLink 2 omits trailing zeros.
    return found.payload.ljust(_HEARTBEAT_SIZE, b"\0")[_HEARTBEAT_TYPE]


def first_stamp_us(records: bytes) -> int:
    """The time of the first record, in microseconds since the Unix epoch."""
    return int.from_bytes(records[:_STAMP_SIZE], "big")


def _loggable(frame: bytes) -> bytes:
    """A MAVLink 2 frame as it is logged, or empty if it must not be."""
    if frame[_MSGID] == _SETUP_SIGNING:
        return b""
    return _without_signature(frame) if frame[2] & _SIGNED else frame


def _without_signature(frame: bytes) -> bytes:
    """Clear the flag, cut the signature, and recompute the CRC, which covers the flags."""
    checked = frame[1:2] + bytes((frame[2] & ~_SIGNED,)) + frame[3 : -_SIGNATURE_SIZE - _CRC_SIZE]
    crc = mcrf4xx(checked + CRC_EXTRA[int.from_bytes(frame[_MSGID], "little")])
    return frame[:1] + checked + crc.to_bytes(_CRC_SIZE, "little")
