# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV: the recognition and the profile."""

from dataclasses import replace

from bridge.controllers.inav.geozones import InavGeozones, has_zones
from bridge.controllers.inav.limits import saved_limits
from bridge.controllers.inav.mission_store import InavMissions
from bridge.controllers.inav.safehomes import InavSafehomes
from bridge.controllers.inav.settings import InavFcSettings
from bridge.controllers.inav.telemetry import INAV_DECODERS, INAV_POLLS, arming_blockers
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.fc.profile import SILENCE_WITH_H7_S, FlightController, Interview, Profile
from bridge.line.conversation import Conversation
from bridge.line.poll_schedule import NAV_POLL, POLLS
from bridge.missions.place_lists import NO_PLACES
from bridge.model.craft import FAILSAFE_BOX, Airframe
from protocols.msp.inav import MIXER, MIXER_SIZE, decode_platform
from protocols.msp.nav import INFO_SIZE, Nav, decode_info
from protocols.rights.msp import Firmware

_VARIANT = "INAV"
#: The constant bytes of GETINFO.
_STABLE_INFO = 2
#: By INAV's platform type, from 0.
_AIRFRAMES = (
    Airframe.QUADROTOR,
    Airframe.FIXED_WING,
    Airframe.HELICOPTER,
    Airframe.TRICOPTER,
    Airframe.ROVER,
    Airframe.BOAT,
)
#: Permanent box ids (docs/inav.md) of the modes that make a flight mode.
_BOXES = {
    0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "NAV ALTHOLD", 10: "NAV RTH", 11: "NAV POSHOLD", 12: "MANUAL",
    27: FAILSAFE_BOX, 28: "NAV WP", 36: "NAV LAUNCH", 45: "NAV COURSE HOLD", 53: "NAV CRUISE", 64: "ANGLE HOLD",
}  # fmt: skip


def _recognise(board: Interview) -> Conversation[FlightController | None]:
    if (yield from board.ident()) is not None or (yield from board.variant()) != _VARIANT:
        return None
    boxes = yield from board.boxes_by_id(_BOXES)
    controller = FlightController(PROFILE, PROFILE.name, boxes=boxes, firmware=Firmware.INAV)
    # The pilot may load another mission at any time: only the capacity is constant.
    info = decode_info((yield from board.ask(Nav.GETINFO, INFO_SIZE, stable=_STABLE_INFO)).payload)
    if info is None or not info.capacity or controller.arm_bit is None:
        # An arm flag is needed to prevent a mission write in flight.
        return None
    platform = decode_platform((yield from board.ask(MIXER, MIXER_SIZE)).payload)
    airframe = _AIRFRAMES[platform] if platform is not None and platform < len(_AIRFRAMES) else None
    version = yield from board.version()
    return replace(controller, airframe=airframe, capacity=info.capacity, version=version)


PROFILE = Profile(
    "INAV",
    "INAV",
    recognise=_recognise,
    polls=(*POLLS, NAV_POLL, *INAV_POLLS),
    decoders=INAV_DECODERS,
    arming_blockers=arming_blockers,
    has_2d_fix=True,
    accepts_any_byte=True,
    calibrates_six_positions=True,
    # The serial task runs 100 times a second (fc_tasks.c).
    turn_s=0.01,
    silence_s=SILENCE_WITH_H7_S,
    missions=lambda board, vehicle, _: InavMissions(NavProfile(board.capacity), board, vehicle),
    fences=lambda board, _vehicle: InavGeozones(board) if has_zones(board) else NO_PLACES,
    rally=lambda board, _vehicle: InavSafehomes(board),
    settings=InavFcSettings,
    check_kind="inav",
    rules=lambda settings: NavRules(NavProfile(limits=saved_limits(settings.saved))),
)
