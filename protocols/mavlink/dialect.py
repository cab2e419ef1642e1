# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink dialect that the bridge itself speaks.

ardupilotmega is the dialect because ground stations treat the vehicle as an ArduCopter: they send it
AUTOPILOT_VERSION_REQUEST, for instance. Frames of all other dialects' messages can be checked and forwarded, too.
"""

from typing import Any, TypeAlias

from protocols.mavlink import messages
from protocols.mavlink.message_table import MESSAGE_FORMATS

#: A decoded or not yet packed message: its fields depend on its class.
Message: TypeAlias = Any
#: CRC_EXTRA, one byte, by message id.
CRC_EXTRA = {msgid: bytes((known.crc_extra,)) for msgid, known in MESSAGE_FORMATS.items()}

__all__ = ["CRC_EXTRA", "MESSAGE_FORMATS", "Message", "messages"]
