"""Whom a frame is meant for, read from its bytes without decoding it."""

import struct

from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkFrame

_HEADER_V1 = 6
_HEADER_V2 = 10


def _targets() -> dict[int, tuple[int, int | None]]:
    """Return where target_system and target_component stand in the payload of each message that has them."""
    found: dict[int, tuple[int, int | None]] = {}
    for msgid, kind in messages.mavlink_map.items():
        places: dict[str, int] = {}
        at = 0
        for index, name in enumerate(kind.ordered_fieldnames):
            places[name] = at
            at += struct.calcsize(f"<{chr(kind.native_format[index + 1])}") * max(1, kind.array_lengths[index])
        if "target_system" in places:
            found[msgid] = (places["target_system"], places.get("target_component"))
    return found


_TARGETS = _targets()


def target_of(frame: MavlinkFrame) -> tuple[int, int]:
    """Return the system and the component that a frame is meant for; 0: for all. MAVLink 2 cuts trailing zeros."""
    places = _TARGETS.get(frame.msgid)
    if places is None:
        return 0, 0
    raw = frame.raw
    start = _HEADER_V1 if frame.version == 1 else _HEADER_V2
    size = raw[1]
    system_at, component_at = places
    system = raw[start + system_at] if system_at < size else 0
    if component_at is None or component_at >= size:
        return system, 0
    return system, raw[start + component_at]
