# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii 2.4 with navigation: its recognition and its profile."""

from dataclasses import replace

from bridge.controllers.msp_parts import MspPartSettings
from bridge.controllers.multiwii.mission_store import MultiwiiMissions
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import MULTIWII_CAPACITY, multiwii_profile
from bridge.fc.profile import FlightController, Interview, Profile
from bridge.line.conversation import Conversation
from bridge.line.poll_schedule import NAV_POLL, POLLS
from bridge.model.craft import airframe
from protocols.msp.nav import NAV_CONFIG_SIZE, Nav, decode_nav_config
from protocols.rights.msp import Firmware

#: types.h: analog.amperage.
CURRENTS_PER_A = 10
#: IDENT's capability bit of boards that fly missions.
_NAV_CAPABILITY = 1 << 4


def _recognise(board: Interview) -> Conversation[FlightController | None]:
    ident = yield from board.ident()
    if ident is None or not ident.capability & _NAV_CAPABILITY or (yield from board.variant()) is not None:
        return None
    boxes = yield from board.box_names()
    name = f"MultiWii {ident.version}"
    controller = FlightController(
        PROFILE, name, airframe(ident.mixer), boxes, version=ident.release, firmware=Firmware.MULTIWII
    )
    if controller.arm_bit is None:
        return None
    capacity = decode_nav_config((yield from board.ask(Nav.NAV_CONFIG, NAV_CONFIG_SIZE)).payload)
    if not capacity:
        return None
    return replace(controller, capacity=capacity)


PROFILE = Profile(
    "MultiWii NAV",
    "MultiWii",
    recognise=_recognise,
    polls=(*POLLS, NAV_POLL),
    accepts_any_byte=True,
    currents_per_a=CURRENTS_PER_A,
    # Its own axes are left, back and up (IMU.cpp).
    acc_axes=((1, -1), (0, -1), (2, -1)),
    missions=lambda board, vehicle, _: MultiwiiMissions(multiwii_profile(board.capacity), board, vehicle),
    settings=MspPartSettings,
    check_kind="multiwii",
    rules=lambda settings: NavRules(multiwii_profile(settings.capacity or MULTIWII_CAPACITY)),
)
