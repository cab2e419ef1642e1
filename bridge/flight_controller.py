"""Which flight controller is on the line, found out by asking it (harakiri.md, inav.md)."""

from dataclasses import dataclass, replace
from enum import Enum

from bridge.procedure import Procedure, ask_surely
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.mission import INFO_SIZE, Info, MissionCommand, decode_info
from protocols.msp.telemetry import decode_box_names, decode_ident

_HARAKIRI_VERSION = 211
_HARAKIRI_CAPABILITY = 0x80000000
#: Harakiri's own box, which no relative has.
_HARAKIRI_BOX = "GTUNE"
_ARM_BOX = "ARM"
_MAX_REPLY_PAYLOAD = 200


class Kind(Enum):
    """What the bridge can do with a flight controller hangs on this."""

    HARAKIRI_MISSIONS = "Harakiri with the mission extension"
    HARAKIRI = "Harakiri without the mission extension"
    OTHER_MSP = "another MSP flight controller"
    HARAKIRI_MAVLINK = "Harakiri in MAVLink mode"
    MAVLINK = "another MAVLink autopilot"
    FRSKY = "Harakiri in FrSky mode"


@dataclass(frozen=True, slots=True)
class FlightController:
    """Who it is. `boxes` are in the order of the status flags; `info` is there with the extension."""

    kind: Kind
    name: str
    mixer: int | None = None
    boxes: tuple[str, ...] = ()
    info: Info | None = None

    @property
    def arm_bit(self) -> int | None:
        """The place of the ARM box in the status flags."""
        return self.boxes.index(_ARM_BOX) if _ARM_BOX in self.boxes else None

    @property
    def is_harakiri(self) -> bool:
        """Whether it is a Harakiri that answers MSP."""
        return self.kind in (Kind.HARAKIRI, Kind.HARAKIRI_MISSIONS)


class _Silence(Exception):
    """A question stayed unanswered: what is not known is not guessed."""


def identify_msp() -> Procedure[FlightController | None]:
    """Ask an MSP flight controller who it is; None if a question stayed unanswered."""
    try:
        return (yield from _identify())
    except _Silence:
        return None


def _identify() -> Procedure[FlightController]:
    ident = decode_ident((yield from _question(Msp.IDENT, 7)).payload)
    boxes = decode_box_names((yield from _question(Msp.BOXNAMES, _MAX_REPLY_PAYLOAD)).payload)
    controller = FlightController(Kind.OTHER_MSP, "", ident.mixer if ident else None, boxes)
    is_harakiri = (
        ident is not None
        and (ident.version, ident.capability) == (_HARAKIRI_VERSION, _HARAKIRI_CAPABILITY)
        and _HARAKIRI_BOX in boxes
    )
    if is_harakiri:
        # Only a Harakiri is asked: to others these command numbers mean nothing.
        info = decode_info((yield from _question(MissionCommand.INFO, INFO_SIZE)).payload)
        kind = Kind.HARAKIRI if info is None else Kind.HARAKIRI_MISSIONS
        return replace(controller, kind=kind, name=kind.value, info=info)
    variant = yield from _question(Msp.FC_VARIANT, 4)
    if variant.direction is Direction.REPLY:
        return replace(controller, name=variant.payload.decode("ascii", "replace"))
    return replace(controller, name=f"MultiWii {ident.version}" if ident else "unknown")


def _question(command: int, reply_payload: int) -> Procedure[MspFrame]:
    """Ask, and take an error frame for an answer too: it says that the command is not known."""
    reply = yield from ask_surely(request(command), command, reply_payload)
    if reply is None:
        raise _Silence
    return reply
