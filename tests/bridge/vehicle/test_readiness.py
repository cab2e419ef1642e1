# SPDX-License-Identifier: GPL-3.0-or-later
"""The craft's readiness: whatever it is, every client is told the same."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mission_item import MissionResult
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults, SimOptions
from simulator.commands.fc_kinds import make_board
from tests.support.conversations import Upload, waypoints
from tests.support.qgc_upload import QGC_HEARTBEAT
from tests.support.screens import Screens
from tests.support.world import GroundStation, World

PREARM = m.MAV_SYS_STATUS_PREARM_CHECK
RC_LINK = 1 << 18
NO_LINK, CALIBRATING = "No link to the flight controller", "Calibrating: try again when it is done"
START_MAG_CAL = m.MAVLink_command_long_message(1, 1, m.MAV_CMD_DO_START_MAG_CAL, 0, 0, 1, 1, 0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class Told:
    """What each client was told last: heartbeat, SYS_STATUS, PreArm text, the page and zenoh; None: no text."""

    system_status: int
    is_ready: bool
    prearm: str | None
    published: str
    refusal: str | None


def naze(*, powered: bool = True, seconds: float = 15.0) -> World:
    world = World(SimOptions(), speeds=(115200,), powered=powered)
    if powered:
        world.wait_ready()
    world.run(seconds)
    return world


def blocked() -> World:
    faults = Faults(boxes=0, arming_blockers=RC_LINK)
    world = World(speeds=(115200,), peer=make_board("inav", MspOptions(), faults))
    world.faults = faults
    world.wait_ready(then_s=3)
    return world


def lost() -> World:
    world = naze()
    world.power_off()
    world.run(10)
    return world


def calibrating() -> World:
    world = naze()
    GroundStation(world, "page").send(START_MAG_CAL)
    world.run(20)
    return world


STATES: dict[str, tuple[Callable[[], World], Told]] = {
    "ready": (naze, Told(m.MAV_STATE_STANDBY, True, None, "ready", None)),
    "blocked": (blocked, Told(m.MAV_STATE_STANDBY, False, "PreArm: no RC link", "blocked", None)),
    "lost": (lost, Told(m.MAV_STATE_CRITICAL, False, "PreArm: flight controller lost", "lost", NO_LINK)),
    "calibrating": (
        calibrating,
        Told(m.MAV_STATE_CALIBRATING, False, "PreArm: calibrating: wait until it is done", "calibrating", CALIBRATING),
    ),
    "unknown": (lambda: naze(powered=False, seconds=2.0), Told(m.MAV_STATE_UNINIT, False, None, "unknown", NO_LINK)),
    "never found": (
        lambda: naze(powered=False),
        Told(m.MAV_STATE_CRITICAL, False, "PreArm: no flight controller: check power, wiring", "never found", NO_LINK),
    ),
}


@pytest.mark.parametrize("name", STATES)
def test_every_client_gets_the_same_state(name: str) -> None:
    make, expected = STATES[name]
    world = make()
    station = GroundStation(world)
    station.send(QGC_HEARTBEAT, wait_s=1.5)
    status = station.messages("SYS_STATUS")[-1]
    refusal = None
    if expected.refusal is not None:
        assert Upload(station, waypoints(5)).run() is MissionResult.DENIED
        refusal = next((text for text in station.texts() if text == expected.refusal), "none")
    told = Told(
        station.messages("HEARTBEAT")[-1].system_status,
        bool(status.onboard_control_sensors_enabled & status.onboard_control_sensors_health & PREARM),
        next((text for text in station.texts() if text.startswith("PreArm")), None),
        world.bridge.report(world.now).status.readiness,
        refusal,
    )
    assert told == expected
    why = world.bridge.report(world.now).status.not_ready_why
    assert (expected.prearm or "").removeprefix("PreArm: ") == ", ".join(why) or name == "unknown"


def test_a_write_is_not_a_reason_not_to_arm() -> None:
    world = naze()
    station = GroundStation(world)
    screens = Screens(station)
    world.run(3)
    seen = set()
    upload = Upload(station, waypoints(100))
    station.on_message.append(lambda _message: seen.add(world.bridge.report(world.now).status.readiness))
    assert upload.run() is MissionResult.ACCEPTED
    world.run(2)
    assert "writing" in seen
    assert screens.glance().ready_to_arm
    assert not any(text.startswith("PreArm") for text in station.texts())


def test_the_end_of_all_reasons_is_info_for_qgroundcontrol() -> None:
    """Which takes each text that begins with PreArm for one."""
    world = blocked()
    station = GroundStation(world)
    station.send(QGC_HEARTBEAT, wait_s=2)
    world.faults.arming_blockers = 0
    world.run(3)
    assert station.texts() == ["PreArm: no RC link", "Ready to arm"]


def test_a_flying_craft_that_is_lost_does_not_fly_on_in_qgroundcontrol() -> None:
    world = naze()
    station, planner = GroundStation(world), GroundStation(world, "planner")
    station.heartbeat = QGC_HEARTBEAT
    qgc, mission_planner = Screens(station), Screens(planner)
    world.arm(then_s=5)
    assert qgc.glance().qgc == "Flying"
    world.faults.hang = True
    world.run(5)
    for _ in range(10):
        world.run(1)
        assert (qgc.glance().qgc, mission_planner.glance().armed, mission_planner.glance().failsafe) == (
            "Armed",
            True,
            True,
        )
    assert station.messages("EXTENDED_SYS_STATE")[-1].landed_state == m.MAV_LANDED_STATE_UNDEFINED


def test_the_charge_of_a_lost_craft_is_the_last_known() -> None:
    """Mission Planner shows MAVLink's unknown as 0 %."""
    world = naze()
    station = GroundStation(world)
    station.send(QGC_HEARTBEAT, wait_s=3)
    before = station.messages("SYS_STATUS")[-1].battery_remaining
    assert before > 0
    world.power_off()
    world.run(10)
    assert station.messages("SYS_STATUS")[-1].battery_remaining == before
