# SPDX-License-Identifier: GPL-3.0-or-later
"""The target of a frame, read from its bytes without decoding it."""

from protocols.mavlink.frame import MAGIC_V2, MavlinkFrame
from protocols.mavlink.message_table import MESSAGE_FORMATS

_HEADER_V1 = 6
_HEADER_V2 = 10
#: Offsets of target_system and target_component in the payload, by the message id's bytes in the header: three in
#: MAVLink 2, one in MAVLink 1.
_PLACES = {
    msgid.to_bytes(size, "little"): (known.target_system_at, known.target_component_at)
    for msgid, known in MESSAGE_FORMATS.items()
    if known.target_system_at is not None
    for size in (1, 3)
    if msgid < 256**size
}


def has_target_field(msgid: int) -> bool:
    return msgid.to_bytes(3, "little") in _PLACES


def target_of(frame: MavlinkFrame) -> tuple[int, int]:
    """Return the target system and component of a frame.

    0 means all: the message has no such field, or MAVLink 2 has omitted it with the trailing zeros.
    """
    raw = frame.raw
    is_v2 = raw[0] == MAGIC_V2
    places = _PLACES.get(raw[7:10] if is_v2 else raw[5:6])
    if places is None:
        return 0, 0
    start = _HEADER_V2 if is_v2 else _HEADER_V1
    size = raw[1]
    system_at, component_at = places
    system = raw[start + system_at] if system_at < size else 0
    component = raw[start + component_at] if component_at is not None and component_at < size else 0
    return system, component
