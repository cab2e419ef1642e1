# SPDX-License-Identifier: GPL-3.0-or-later
"""The requests of other programs that may reach the flight controller."""

from bridge.fc.profile import FlightController
from bridge.line.msp_link import MspLink
from protocols.msp.command_line import is_clean
from protocols.msp.frame import MspFrame, request
from protocols.msp.nav import Nav, UnsafeRecord, decode_wp, encode_set_wp
from protocols.rights.effect import Effect
from protocols.rights.msp import MSP_RIGHTS, MspRight, msp_right

ARMED = "armed"


def right_of(frame: MspFrame, controller: FlightController) -> MspRight:
    return msp_right(controller.firmware, frame.command, frame.payload)


def is_unknown_read(right: MspRight, frame: MspFrame) -> bool:
    """True if this flight controller has no handler for a request that on every other firmware at most reads."""
    if right.effect is not Effect.UNKNOWN:
        return False
    elsewhere = [rights[frame.command] for rights in MSP_RIGHTS.values() if frame.command in rights]
    is_read = all(row.effect is Effect.READ for row in elsewhere)
    return is_read and (not frame.payload or any(row.effect_of(frame.payload) is Effect.READ for row in elsewhere))


def refusal(frame: MspFrame, right: MspRight, link: MspLink, *, may_write: bool, armed: bool | None) -> str:
    """The reason why a request is never forwarded; empty if it may be."""
    if right.effect is Effect.MOVE:
        return "never forwarded"
    if right.effect is Effect.UNKNOWN:
        return "unknown on this board"
    if right.effect is Effect.CHANGE:
        if not may_write:
            return "read-only share"
        if armed:
            return ARMED
    if not (link.any_byte or is_clean(request(frame.command, frame.payload))):
        return "bytes that open the command line"
    if frame.command == Nav.SET_WP and (record := decode_wp(frame.payload)):
        try:
            encode_set_wp(*record)
        except UnsafeRecord:
            return "a record that crashes INAV"
    return ""
