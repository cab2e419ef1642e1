# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink dialect that the bridge itself speaks: pymavlink's generated message classes.

ardupilotmega is the dialect because ground stations treat the vehicle as an ArduCopter: they send it
AUTOPILOT_VERSION_REQUEST, for instance. Frames of all other dialects' messages can be checked and forwarded, too.
"""

import os
import struct
from collections.abc import Iterator

# pymavlink reads this at import time; its v20 classes can still pack MAVLink 1 frames.
os.environ.setdefault("MAVLINK20", "1")

from typing import Any, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.message_format import MessageFormat
from protocols.mavlink.message_table import BASE_SIZES, OTHER_FORMATS

#: A decoded or not yet packed message; pymavlink's classes are untyped.
Message: TypeAlias = Any
_LAST_V1_ID = 255


def message_format(kind: type[Message], base_size: int | None) -> MessageFormat:
    """The format of one of pymavlink's classes, which do not say where the extension fields begin."""
    places: dict[str, int] = {}
    if "target_system" in kind.fieldnames:
        at = 0
        for name, letter, count in zip(
            kind.ordered_fieldnames, kind.native_format[1:], kind.array_lengths, strict=True
        ):
            places[name] = at
            at += struct.calcsize(f"<{chr(letter)}") * max(1, count)
    system_at, component_at = places.get("target_system"), places.get("target_component")
    return MessageFormat(kind.crc_extra, base_size, kind.unpacker.size, system_at, component_at)


def _formats() -> Iterator[tuple[int, MessageFormat]]:
    yield from OTHER_FORMATS.items()
    for msgid, kind in messages.mavlink_map.items():
        whole_size = kind.unpacker.size if msgid <= _LAST_V1_ID else None
        yield msgid, message_format(kind, BASE_SIZES.get(msgid, whole_size))


#: By message id, of every message that is known to MAVLink.
MESSAGE_FORMATS = dict(sorted(_formats()))
#: CRC_EXTRA, one byte, by message id.
CRC_EXTRA = {msgid: bytes((known.crc_extra,)) for msgid, known in MESSAGE_FORMATS.items()}

__all__ = ["CRC_EXTRA", "MESSAGE_FORMATS", "Message", "messages"]
