# SPDX-License-Identifier: GPL-3.0-or-later
"""HEARTBEAT as evidence that a line carries MAVLink (https://mavlink.io/en/messages/common.html#HEARTBEAT)."""

from protocols.mavlink.frame import MavlinkFrame

_SIZE = 9
_BASE_MODE, _SAFETY_ARMED = 6, 0x80


def is_plausible_heartbeat(frame: MavlinkFrame) -> bool:
    """Check the length, and the fields that have few legal values: type, autopilot, state, MAVLink version."""
    payload = frame.payload
    if frame.msgid != 0 or len(payload) != _SIZE:
        return False
    vehicle_type, autopilot, _, state, version = payload[4:]
    return version == 3 and vehicle_type <= 45 and autopilot <= 20 and state <= 8 and frame.sysid != 0


def is_disarmed_heartbeat(frame: MavlinkFrame) -> bool:
    """True for a HEARTBEAT whose base_mode lacks the bit SAFETY_ARMED."""
    return is_plausible_heartbeat(frame) and not frame.payload[_BASE_MODE] & _SAFETY_ARMED
