# SPDX-License-Identifier: GPL-3.0-or-later
"""COMPONENT_METADATA (https://mavlink.io/en/messages/common.html), which pymavlink's dialects lack. MAVLink 2 only."""

import struct

from protocols.mavlink.codec import Packed, pack_payload

COMPONENT_METADATA = 397
_FIELDS = struct.Struct("<II100s")


def component_metadata(uptime_ms: int, file_crc: int, uri: str) -> Packed:
    """The place of the general metadata file, and its `protocols.mavlink.ftp.file_crc32`."""
    return pack_payload(COMPONENT_METADATA, _FIELDS.pack(uptime_ms, file_crc, uri.encode()))
