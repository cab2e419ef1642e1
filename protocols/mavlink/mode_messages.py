# SPDX-License-Identifier: GPL-3.0-or-later
"""CURRENT_MODE and AVAILABLE_MODES (https://mavlink.io/en/messages/common.html).

pymavlink's ardupilotmega dialect lacks them. Their ids are above 255, so they exist in MAVLink 2 only.
"""

import struct

from protocols.mavlink.codec import Packed, pack_payload

CURRENT_MODE, AVAILABLE_MODES = 436, 435
#: MAV_MODE_PROPERTY_NOT_USER_SELECTABLE: the pilot's switches set the mode, ground stations cannot.
_NOT_SELECTABLE = 2
_CURRENT_MODE = struct.Struct("<IIB")
_AVAILABLE_MODES = struct.Struct("<IIBBB35s")
_UNKNOWN_INTENT = 0


def current_mode(custom_mode: int, standard_mode: int) -> Packed:
    """CURRENT_MODE. standard_mode: MAV_STANDARD_MODE."""
    return pack_payload(CURRENT_MODE, _CURRENT_MODE.pack(custom_mode, _UNKNOWN_INTENT, standard_mode))


def available_mode(index: int, count: int, custom_mode: int, standard_mode: int, name: str) -> Packed:
    """AVAILABLE_MODES for mode `index` (from 1) of `count`."""
    fields = custom_mode, _NOT_SELECTABLE, count, index, standard_mode, name.encode()
    return pack_payload(AVAILABLE_MODES, _AVAILABLE_MODES.pack(*fields))
