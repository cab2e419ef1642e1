# SPDX-License-Identifier: GPL-3.0-or-later
"""Payloads of pymavlink's messages."""

from pymavlink.dialects.v20 import ardupilotmega

from protocols.mavlink.codec import Packed
from protocols.mavlink.dialect import MESSAGE_FORMATS, Message

_HEADER_SIZE, _CRC_SIZE = 10, 2


def pack(message: Message) -> Packed:
    """Like protocols.mavlink.codec.pack."""
    payload = bytes(message.pack(ardupilotmega.MAVLink(None)))[_HEADER_SIZE:-_CRC_SIZE]
    whole = payload.ljust(message.unpacker.size, b"\0")
    return Packed(message.get_msgId(), whole[: MESSAGE_FORMATS[message.get_msgId()].base_size], payload)
