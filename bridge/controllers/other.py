# SPDX-License-Identifier: GPL-3.0-or-later
"""Flight controllers with telemetry only, and autopilots that speak MAVLink themselves."""

from dataclasses import replace

from bridge.controllers.msp_parts import MspPartSettings
from bridge.controllers.multiwii import CURRENTS_PER_A
from bridge.fc.profile import SILENCE_WITH_H7_S, FlightController, Interview, Profile, Spoken
from bridge.line.conversation import Conversation
from bridge.model.craft import FAILSAFE_BOX, airframe
from bridge.model.missions import Refusal
from bridge.voice import sentences
from protocols.mission_item import MissionResult
from protocols.rights.msp import Firmware

#: IDENT's capability bit of all descendants of baseflight; MultiWii's own boards have 8 bits.
_32_BIT = 1 << 31
#: IDENT's capability bit of baseflight. Cleanflight 1 also sets it, but has a variant.
_BASEFLIGHT = 1 << 30
_BETAFLIGHT = "BTFL"
_FIRMWARE = {_BETAFLIGHT: Firmware.BETAFLIGHT, "CLFL": Firmware.CLEANFLIGHT, "INAV": Firmware.INAV}
#: Betaflight's permanent box ids (msp_box.c) of the modes that make a flight mode.
_BETAFLIGHT_BOXES = {
    0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "ALT HOLD", 11: "POS HOLD", 27: FAILSAFE_BOX, 46: "GPS RESCUE",
}  # fmt: skip


def _recognise(board: Interview) -> Conversation[FlightController | None]:
    """Accept any board that answers."""
    ident = yield from board.ident()
    if ident is not None:
        boxes = yield from board.box_names()
        variant = yield from board.variant()
        name = variant or f"MultiWii {ident.version}"
        profile, firmware = OTHER_MSP, _FIRMWARE.get(name, Firmware.UNKNOWN)
        if not ident.capability & _32_BIT:
            profile, firmware = OLD_MULTIWII, Firmware.MULTIWII
        elif variant is None and ident.capability & _BASEFLIGHT:
            firmware = Firmware.BASEFLIGHT
        return FlightController(profile, name, airframe(ident.mixer), boxes, version=ident.release, firmware=firmware)
    name = (yield from board.variant()) or "unknown"
    version = None
    if name == _BETAFLIGHT:
        version = yield from board.version()
        boxes = yield from board.boxes_by_id(_BETAFLIGHT_BOXES)
    else:
        boxes = yield from board.box_names()
    firmware = _FIRMWARE.get(name, Firmware.UNKNOWN)
    profile = CLEANFLIGHT if firmware in (Firmware.BETAFLIGHT, Firmware.CLEANFLIGHT) else OTHER_MSP
    return FlightController(profile, name, boxes=boxes, version=version, firmware=firmware)


OTHER_MSP = Profile(
    "another MSP flight controller",
    "other",
    recognise=_recognise,
    silence_s=SILENCE_WITH_H7_S,
    settings=MspPartSettings,
)
#: The parsers of these act on no byte inside a frame.
CLEANFLIGHT = replace(OTHER_MSP, accepts_any_byte=True)
OLD_MULTIWII = replace(CLEANFLIGHT, currents_per_a=CURRENTS_PER_A)
#: Ground stations write missions to such an autopilot directly; only the command line can ask the bridge to.
OTHER_MAVLINK = Profile(
    "another MAVLink autopilot",
    "MAVLink",
    Spoken.OTHER_MAVLINK,
    missions=Refusal(MissionResult.UNSUPPORTED, sentences.SPEAKS_MAVLINK()),
)
