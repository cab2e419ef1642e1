# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that only INAV reports: version, platform, load, battery, airspeed, failsafe, arming blockers."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.model.vehicle import Charge, GpsTime, Load, MissionLeg, Power
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.nav import NavMode, NavStatus
from simulator.board.msp_board import MspBoard
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from simulator.inav.boxes import BOXES, NAV_WP, PLANE_BOXES
from tests.bridge.controllers.inav.test_mission_store import board_with
from tests.bridge.controllers.nav.test_mission_store import plan
from tests.support.conversations import Upload
from tests.support.world import GroundStation, World

FAILSAFE, PLANE_FAILSAFE = (1 << boxes.index(27) for boxes in (BOXES["9.1.0"], PLANE_BOXES))


def introduced(**options: Any) -> tuple[MspBoard, World, GroundStation]:
    board, world, station = board_with(**options)
    station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), wait_s=3)
    return board, world, station


@pytest.mark.parametrize(
    ("platform", "kind", "by_hand"),
    [
        (0, messages.MAV_TYPE_QUADROTOR, messages.COPTER_MODE_ACRO),
        (1, messages.MAV_TYPE_FIXED_WING, messages.PLANE_MODE_ACRO),
        (2, messages.MAV_TYPE_HELICOPTER, messages.COPTER_MODE_ACRO),
        (3, messages.MAV_TYPE_TRICOPTER, messages.COPTER_MODE_ACRO),
        (4, messages.MAV_TYPE_GROUND_ROVER, messages.ROVER_MODE_MANUAL),
        (5, messages.MAV_TYPE_SURFACE_BOAT, messages.ROVER_MODE_MANUAL),
    ],
)
def test_the_platform_determines_the_vehicle_type(platform: int, kind: int, by_hand: int) -> None:
    _, _, station = introduced(platform=platform, faults=Faults(boxes=0))
    last = station.messages("HEARTBEAT")[-1]
    assert (last.type, last.custom_mode) == (kind, by_hand)


@pytest.mark.parametrize(
    ("box", "mode"),
    [(12, messages.PLANE_MODE_MANUAL), (45, messages.PLANE_MODE_CRUISE), (64, messages.PLANE_MODE_STABILIZE)],
)
def test_an_aeroplanes_own_boxes_are_modes(box: int, mode: int) -> None:
    _, _, station = introduced(platform=1, faults=Faults(boxes=1 << PLANE_BOXES.index(box)))
    assert station.messages("HEARTBEAT")[-1].custom_mode == mode


@pytest.mark.parametrize(("platform", "pitot"), [(1, True), (1, False), (0, True), (0, False)])
def test_airspeed_is_measured_or_unknown(platform: int, pitot: bool) -> None:
    """Ground speed stands in for airspeed on a copter, as in ArduCopter, but not on a plane."""
    _, world, station = introduced(platform=platform, pitot=pitot, faults=Faults(boxes=0))
    world.run(2)
    hud = station.messages("VFR_HUD")[-1]
    if pitot:
        assert hud.airspeed == pytest.approx(hud.groundspeed + 2.5)
    elif platform == 1:
        assert math.isnan(hud.airspeed)
    else:
        assert hud.airspeed == hud.groundspeed


@pytest.mark.parametrize(("platform", "failsafe", "seconds"), [(0, FAILSAFE, 0.5), (1, PLANE_FAILSAFE, 1.5)])
def test_a_failsafe_is_critical_at_once_and_only_in_flight(platform: int, failsafe: int, seconds: float) -> None:
    """A plane's flag is not among the 32 of MSP_STATUS."""
    board, world, station = introduced(platform=platform, faults=Faults(boxes=failsafe))
    assert station.messages("HEARTBEAT")[-1].system_status == messages.MAV_STATE_STANDBY
    board.faults.armed, board.faults.boxes = True, 0
    world.run(2)
    assert station.messages("HEARTBEAT")[-1].system_status == messages.MAV_STATE_ACTIVE
    board.faults.boxes = failsafe
    world.run(seconds)
    assert station.messages("HEARTBEAT")[-1].system_status == messages.MAV_STATE_CRITICAL
    board.faults.boxes = 0
    world.run(seconds)
    assert station.messages("HEARTBEAT")[-1].system_status == messages.MAV_STATE_ACTIVE
    texts = [(text.severity, text.text) for text in station.messages("STATUSTEXT") if "ailsafe" in text.text]
    assert texts == [
        (messages.MAV_SEVERITY_CRITICAL, "Failsafe: the flight controller has taken over"),
        (messages.MAV_SEVERITY_NOTICE, "Failsafe ended: the pilot has control"),
    ]


def test_load_battery_percentage_and_cells_come_from_the_board() -> None:
    _, world, station = introduced()
    vehicle = world.bridge.vehicle
    power, charge, load = vehicle.last(Power), vehicle.last(Charge), vehicle.last(Load)
    assert power is not None
    assert charge is not None
    assert load is not None
    assert (power.cells, power.remaining_percent, charge.drawn_mah) == (3, 88, 120)
    assert load.cpu_load == pytest.approx(0.07)
    status = station.messages("SYS_STATUS")[-1]
    assert (status.load, status.battery_remaining) == (70, 88)
    assert 12_000 < status.voltage_battery < 12_700


@pytest.mark.parametrize("unix_s", [0.0, 1_777_636_800.0])
def test_the_boards_time_is_known_once_the_gps_has_it(unix_s: float) -> None:
    _, world, _ = introduced(unix_s=unix_s)
    time = world.bridge.vehicle.last(GpsTime)
    assert (time is not None) == bool(unix_s)
    if time is not None:
        assert time.unix_s - unix_s == pytest.approx(time.heard_at, abs=0.1)


def test_loading_a_mission_during_identification_does_not_hide_the_board() -> None:
    """The record count may change with every GETINFO; only the capacity is compared."""
    board = make_board("inav", MspOptions(), Faults(boxes=0))
    world = World(speeds=(115200,), peer=board)
    original, counts = board.receive, iter(range(1, 10_000))

    def receive(data: bytes, now: float) -> None:
        mission = board._firmware._mission if board._firmware else None  # type: ignore[attr-defined]
        if mission is not None:
            mission.count = next(counts) % 100
        original(data, now)

    board.receive = receive  # type: ignore[method-assign]
    world.wait_until(lambda w: w.kind is not None and w.kind.name == "INAV", 15)


def test_the_current_item_is_reported_together_with_nav_status() -> None:
    board, world, station = introduced()
    home = (453838000, 84733000)
    legs = [MissionItem(n, 16, 3, 0, 0, 0, 0, home[0] + 500 * n, home[1], 4.0) for n in (1, 2, 3)]
    assert Upload(station, [plan(1)[0], *legs]).run() is MissionResult.ACCEPTED
    board.faults.armed, board.faults.boxes = True, 1 << BOXES["9.1.0"].index(NAV_WP)
    seen: set[int] = set()
    while not seen or station.messages("MISSION_CURRENT")[-1].mission_state != messages.MISSION_STATE_COMPLETE:
        assert world.now < 100
        world.run(0.1)
        leg = world.bridge.vehicle.last(MissionLeg)
        status = None if leg is None else leg.report
        if isinstance(status, NavStatus) and status.mode == NavMode.MISSION:
            seen.add(status.number)
            assert station.messages("MISSION_CURRENT")[-1].seq == status.number
    assert seen == {1, 2, 3}
