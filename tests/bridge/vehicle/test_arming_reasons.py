# SPDX-License-Identifier: GPL-3.0-or-later
"""Reasons not to arm are reported when they change."""

from pymavlink.dialects.v20 import ardupilotmega as messages

from simulator.board.options import Faults
from tests.bridge.controllers.inav.test_telemetry import introduced

PREARM = messages.MAV_SYS_STATUS_PREARM_CHECK


RC_LINK, NOT_LEVEL = 1 << 18, 1 << 8


def test_arming_blockers_are_reported_when_they_change() -> None:
    board, world, station = introduced(faults=Faults(boxes=0, arming_blockers=RC_LINK | NOT_LEVEL))
    assert station.messages("SYS_STATUS")[-1].onboard_control_sensors_health & PREARM == 0
    assert [text for text in station.texts() if "Arm" in text] == ["PreArm: not level, no RC link"]
    board.faults.arming_blockers = 0
    world.run(3)
    assert station.messages("SYS_STATUS")[-1].onboard_control_sensors_health & PREARM
    assert [text for text in station.texts() if "rm" in text][1:] == ["Ready to arm"]
