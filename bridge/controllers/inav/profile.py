# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV: its recognition and its profile."""

from bridge.controllers.inav.mission_store import InavMissions
from bridge.controllers.inav.telemetry import INAV_DECODERS, INAV_POLLS
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.mission_store import NavCraft
from bridge.controllers.nav.rules import INAV_CAPACITY, inav_profile
from bridge.fc.interview import Interview
from bridge.fc.profile import FlightController, Profile, RuleSettings, VehicleView
from bridge.line.conversation import Conversation
from bridge.line.poll_schedule import NAV_POLL, POLLS
from bridge.missions.fc_mission_store import AnyFcMissionStore
from protocols.msp.inav import MIXER, MIXER_SIZE, decode_platform
from protocols.msp.nav import INFO_SIZE, Nav, decode_info

_VARIANT = "INAV"
#: The constant bytes of GETINFO.
_LASTING_INFO = 2
#: MultiWii's MULTITYPE for INAV's platform types: aeroplane, helicopter, tricopter. Others are shown as a quadrocopter.
_MIXERS = {1: 14, 2: 15, 3: 1}
#: Permanent box ids (docs/inav.md) of the modes that make a flight mode.
_BOXES = {0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "NAV ALTHOLD", 10: "NAV RTH", 11: "NAV POSHOLD", 28: "NAV WP"}


def _recognise(board: Interview) -> Conversation[FlightController | None]:
    if (yield from board.ident()) is not None or (yield from board.variant()) != _VARIANT:
        return None
    boxes = yield from board.boxes_by_id(_BOXES)
    controller = FlightController(PROFILE, PROFILE.name, boxes=boxes)
    # The pilot may load another mission meanwhile: only the capacity is constant.
    info = decode_info((yield from board.ask(Nav.GETINFO, INFO_SIZE, lasting=_LASTING_INFO)).payload)
    if info is None or not info.capacity or controller.arm_bit is None:
        # Without an arm flag nothing would prevent a mission write in flight.
        return None
    platform = decode_platform((yield from board.ask(MIXER, MIXER_SIZE)).payload)
    mixer = _MIXERS.get(platform or 0)
    version = yield from board.version()
    return FlightController(PROFILE, PROFILE.name, mixer, boxes, capacity=info.capacity, version=version)


def _rules(settings: RuleSettings) -> NavRules:
    return NavRules(inav_profile(settings.capacity or INAV_CAPACITY))


def _open_store(controller: FlightController, view: VehicleView, _settings: RuleSettings) -> AnyFcMissionStore:
    assert controller.arm_bit is not None
    craft = NavCraft(1 << controller.arm_bit, view.is_armed, view.home, view.position)
    return InavMissions(inav_profile(controller.capacity), craft)


PROFILE = Profile(
    "INAV",
    "INAV",
    recognise=_recognise,
    polls=(*POLLS, NAV_POLL, *INAV_POLLS),
    decoders=INAV_DECODERS,
    has_2d_fix=True,
    accepts_any_byte=True,
    open_store=_open_store,
    check_kind="inav",
    rules=_rules,
)
