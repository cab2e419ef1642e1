# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages that pymavlink's ardupilotmega dialect lacks (https://mavlink.io/en/messages/common.html).

Their ids are above 255, so they exist in MAVLink 2 only.
"""

import struct

from protocols.mavlink.codec import Packed, pack_payload

COMPONENT_METADATA, AVAILABLE_MODES, CURRENT_MODE = 397, 435, 436
#: MAV_MODE_PROPERTY_NOT_USER_SELECTABLE: the pilot's switches set the mode, ground stations cannot.
_NOT_SELECTABLE = 2
_COMPONENT_METADATA = struct.Struct("<II100s")
_AVAILABLE_MODES = struct.Struct("<IIBBB35s")
_CURRENT_MODE = struct.Struct("<IIB")
_UNKNOWN_INTENT = 0


def component_metadata(uptime_ms: int, file_crc: int, uri: str) -> Packed:
    """The place of the general metadata file, and its `protocols.mavlink.ftp.file_crc32`."""
    return pack_payload(COMPONENT_METADATA, _COMPONENT_METADATA.pack(uptime_ms, file_crc, uri.encode()))


def available_mode(index: int, count: int, custom_mode: int, standard_mode: int, name: str) -> Packed:
    """AVAILABLE_MODES for mode `index` (from 1) of `count`. standard_mode: MAV_STANDARD_MODE."""
    fields = custom_mode, _NOT_SELECTABLE, count, index, standard_mode, name.encode()
    return pack_payload(AVAILABLE_MODES, _AVAILABLE_MODES.pack(*fields))


def current_mode(custom_mode: int, standard_mode: int) -> Packed:
    return pack_payload(CURRENT_MODE, _CURRENT_MODE.pack(custom_mode, _UNKNOWN_INTENT, standard_mode))
