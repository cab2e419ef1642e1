# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink dialect: pymavlink's `all`, for messages and constants, and to check and forward frames.

>>> from protocols.mavlink.dialect import messages
>>> messages.MAVLink_statustext_message(messages.MAV_SEVERITY_INFO, b"Mission stored")

`all` is ardupilotmega (ground stations treat the vehicle as an ArduCopter, and send it AUTOPILOT_VERSION_REQUEST, for
instance) and the messages of all other autopilots. A frame of a message that it lacks looks damaged, because a checksum
needs the message's CRC_EXTRA. Where a smaller dialect (matrixpilot, paparazzi) reuses an id, `all` has the message of
ardupilotmega.
"""

import struct
from enum import IntEnum
from typing import Any, NamedTuple, TypeAlias

from pymavlink.dialects.v20 import all as messages

#: A decoded or not yet packed message: the fields depend on the class.
Message: TypeAlias = Any
_LAST_V1_ID = 255


class MessageFormat(NamedTuple):
    """The name, checksum seed and layout of one kind of message. Sizes and places are in bytes of the payload.

    Sizes: `full_size` with extension fields. `base_size` without, as in MAVLink 1 (None: the id is above 255, so not in
    MAVLink 1). Places: None if the message lacks the field.
    """

    name: str
    crc_extra: int
    base_size: int | None
    full_size: int
    target_system_at: int | None
    target_component_at: int | None


def _format(kind: Any) -> MessageFormat:
    """The format of one of pymavlink's classes. Extension fields are those that the constructor may omit.

    It may also omit HEARTBEAT's mavlink_version, the one constant field.
    """
    optional = kind.fieldnames[len(kind.fieldnames) - len(kind.__init__.__defaults__ or ()) :]
    extensions = set(optional) - {"mavlink_version"}
    places, at, base_size = {}, 0, 0
    for name, letter, count in zip(kind.ordered_fieldnames, kind.native_format[1:], kind.array_lengths, strict=True):
        places[name] = at
        at += struct.calcsize(f"<{chr(letter)}") * max(1, count)
        base_size = base_size if name in extensions else at
    targets = places.get("target_system"), places.get("target_component")
    return MessageFormat(kind.msgname, kind.crc_extra, base_size if kind.id <= _LAST_V1_ID else None, at, *targets)


#: By message id. COMPONENT_METADATA is in common.xml, but not in pymavlink's `all`.
MESSAGE_FORMATS = {msgid: _format(kind) for msgid, kind in messages.mavlink_map.items()} | {
    397: MessageFormat("COMPONENT_METADATA", 182, None, 108, None, None)
}
#: CRC_EXTRA, one byte, by message id.
CRC_EXTRA = {msgid: bytes((known.crc_extra,)) for msgid, known in MESSAGE_FORMATS.items()}


class CommandResult(IntEnum):
    """MAV_RESULT (https://mavlink.io/en/messages/common.html#MAV_RESULT)."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


def command_name(command: int) -> str:
    """A MAV_CMD's name as Mission Planner lists it, or its number."""
    known = messages.enums["MAV_CMD"].get(command)
    return str(command) if known is None else known.name.removeprefix("MAV_CMD_").removeprefix("NAV_")


__all__ = ["CRC_EXTRA", "MESSAGE_FORMATS", "CommandResult", "Message", "MessageFormat", "command_name", "messages"]
