# SPDX-License-Identifier: GPL-3.0-or-later
"""Which flight controller is on the line, found out by asking it (harakiri.md, inav.md)."""

from dataclasses import dataclass, replace
from enum import Enum

from bridge.controllers.box_ids import box_names
from bridge.line.conversation import Conversation, ask_surely
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.mission import INFO_SIZE, Info, MissionCommand, decode_info
from protocols.msp.nav import INFO_SIZE as WP_INFO_SIZE
from protocols.msp.nav import NAV_CONFIG_SIZE, Nav, decode_nav_config
from protocols.msp.nav import decode_info as decode_wp_info
from protocols.msp.telemetry import decode_box_names, decode_ident

_HARAKIRI_VERSION = 211
_HARAKIRI_CAPABILITY = 0x80000000
#: Harakiri's own box, which no relative has.
_HARAKIRI_BOX = "GTUNE"
_ARM_BOX = "ARM"
_MAX_REPLY_PAYLOAD = 200
#: MultiWii: IDENT's capability bit of a board that flies missions.
_NAV_CAPABILITY = 1 << 4
_INAV = "INAV"
_VARIANT_SIZE = 4


class Kind(Enum):
    """What the bridge can do with a flight controller hangs on this."""

    HARAKIRI_MISSIONS = "Harakiri with the mission extension"
    HARAKIRI = "Harakiri without the mission extension"
    INAV = "INAV"
    MULTIWII_NAV = "MultiWii NAV"
    OTHER_MSP = "another MSP flight controller"
    HARAKIRI_MAVLINK = "Harakiri in MAVLink mode"
    MAVLINK = "another MAVLink autopilot"
    FRSKY = "Harakiri in FrSky mode"


@dataclass(frozen=True, slots=True)
class FlightController:
    """Who it is. `boxes` are in the order of the status flags, "" is one that means nothing here.

    info: a Harakiri's with the extension. capacity: records that an INAV or a MultiWii NAV holds.
    """

    kind: Kind
    name: str
    mixer: int | None = None
    boxes: tuple[str, ...] = ()
    info: Info | None = None
    capacity: int = 0

    @property
    def arm_bit(self) -> int | None:
        """The place of the ARM box in the status flags."""
        return self.boxes.index(_ARM_BOX) if _ARM_BOX in self.boxes else None

    @property
    def is_harakiri(self) -> bool:
        """Whether it is a Harakiri that answers MSP."""
        return self.kind in (Kind.HARAKIRI, Kind.HARAKIRI_MISSIONS)

    @property
    def navigates(self) -> bool:
        """Whether it flies missions and tells where it is in them (NAV_STATUS).

        Such a one also looks for no runs of bytes inside a frame, as a Harakiri does: any whole frame may be sent.
        """
        return self.kind in (Kind.INAV, Kind.MULTIWII_NAV)


class _Silence(Exception):
    """A question stayed unanswered: what is not known is not guessed."""


def identify_msp() -> Conversation[FlightController | None]:
    """Ask an MSP flight controller who it is; None if a question stayed unanswered."""
    try:
        return (yield from _identify())
    except _Silence:
        return None


def _identify() -> Conversation[FlightController]:
    ident = decode_ident((yield from _question(Msp.IDENT, 7)).payload)
    if ident is None:
        return (yield from _identify_variant())
    boxes = decode_box_names((yield from _question(Msp.BOXNAMES, _MAX_REPLY_PAYLOAD)).payload)
    controller = FlightController(Kind.OTHER_MSP, "", ident.mixer, boxes)
    is_harakiri = (ident.version, ident.capability) == (_HARAKIRI_VERSION, _HARAKIRI_CAPABILITY)
    if is_harakiri and _HARAKIRI_BOX in boxes:
        # Only a Harakiri is asked: to others these command numbers mean nothing.
        info = decode_info((yield from _question(MissionCommand.INFO, INFO_SIZE)).payload)
        kind = Kind.HARAKIRI if info is None else Kind.HARAKIRI_MISSIONS
        return replace(controller, kind=kind, name=kind.value, info=info)
    variant = yield from _question(Msp.FC_VARIANT, _VARIANT_SIZE)
    if variant.direction is Direction.REPLY:
        return replace(controller, name=variant.payload.decode("ascii", "replace"))
    controller = replace(controller, name=f"MultiWii {ident.version}")
    if ident.capability & _NAV_CAPABILITY and controller.arm_bit is not None:
        config = yield from _question(Nav.NAV_CONFIG, NAV_CONFIG_SIZE)
        capacity = decode_nav_config(config.payload)
        if capacity:
            return replace(controller, kind=Kind.MULTIWII_NAV, capacity=capacity)
    return controller


def _identify_variant() -> Conversation[FlightController]:
    """Ask one that knows no IDENT: Cleanflight's heirs."""
    variant = yield from _question(Msp.FC_VARIANT, _VARIANT_SIZE)
    is_told = variant.direction is Direction.REPLY
    name = variant.payload.decode("ascii", "replace") if is_told else "unknown"
    ids = yield from _question(Msp.BOXIDS, _MAX_REPLY_PAYLOAD)
    boxes = box_names(name, ids.payload)
    if not boxes:
        # Asked last: where there are many boxes the answer is longer than a frame, and none that could be read.
        boxes = decode_box_names((yield from _question(Msp.BOXNAMES, _MAX_REPLY_PAYLOAD)).payload)
    controller = FlightController(Kind.OTHER_MSP, name, None, boxes)
    if name == _INAV and controller.arm_bit is not None:
        info = decode_wp_info((yield from _question(Nav.GETINFO, WP_INFO_SIZE)).payload)
        if info is not None and info.capacity:
            return replace(controller, kind=Kind.INAV, capacity=info.capacity)
    return controller


def _question(command: int, reply_payload: int) -> Conversation[MspFrame]:
    """Ask, and take an error frame for an answer too: it says that the command is not known."""
    reply = yield from ask_surely(request(command), command, reply_payload)
    if reply is None:
        raise _Silence
    return reply
