# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink dialect that the bridge itself speaks: pymavlink's generated message classes.

ardupilotmega is the dialect because ground stations treat the vehicle as an ArduCopter: they send it
AUTOPILOT_VERSION_REQUEST, for instance.
"""

import os

# pymavlink reads this at import time; its v20 classes can still pack MAVLink 1 frames.
os.environ.setdefault("MAVLINK20", "1")

from typing import Any, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.message_table import MESSAGE_FORMATS

#: CRC_EXTRA, one byte, by message id; for all messages that can be forwarded, not only the dialect's.
CRC_EXTRA = {msgid: bytes((known.crc_extra,)) for msgid, known in MESSAGE_FORMATS.items()}

#: A decoded or not yet packed message; pymavlink's classes are untyped.
Message: TypeAlias = Any

__all__ = ["CRC_EXTRA", "Message", "messages"]
