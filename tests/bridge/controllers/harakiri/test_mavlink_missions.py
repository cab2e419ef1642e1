# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions to a Harakiri that answers only MAVLink, using its own mission messages."""

import math
import re
import struct
from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.harakiri.check import HarakiriRules
from bridge.controllers.harakiri.single_precision import readable_e7
from bridge.missions.list_check import check_list
from bridge.missions.mission_service import HeldMission
from bridge.model.missions import ArrivedMission, Outcome, Refusal
from protocols.mission_item import Command, MissionItem, MissionResult
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.board import SimulatedNaze
from simulator.naze.mission_slots import flash_size
from tests.support.conversations import Download, Upload, waypoints
from tests.support.world import GroundStation, World

A = MissionResult


def mavlink_only(
    faults: Faults | None = None, seed: int = 0, flash: memoryview | None = None, pending: ArrivedMission | None = None
) -> tuple[World, GroundStation]:
    """A Harakiri without the extension that does not answer MSP, found by its MAVLink."""
    faults = faults or Faults()
    faults.extension = faults.msp = False
    board = SimulatedNaze(SimOptions(seed=seed), faults, flash)
    world = World(peer=board, faults=faults, speeds=(115200,), seed=seed)
    world.store.missions += [] if pending is None else [(pending, None)]
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 8)
    world.wait_until(lambda w: w.bridge.vehicle.armed is False and not w.bridge.is_busy, 8)
    return world, GroundStation(world)


def mixed() -> list[MissionItem]:
    """One item of each kind that Harakiri supports."""
    items = waypoints(10)
    items[1] = replace(items[1], command=Command.NAV_TAKEOFF, lat_e7=0, lon_e7=0, alt_m=10.0)
    items[2] = replace(items[2], command=Command.DO_SET_ROI)
    items[3] = replace(items[3], p1=1.0, p4=1.0)
    items[4] = replace(items[4], command=Command.NAV_LOITER_TURNS, p1=-3.0)
    items[5] = replace(items[5], command=Command.NAV_LOITER_TIME, p1=30.0, p2=12.0, alt_m=-7.0)
    items[6] = replace(items[6], command=Command.NAV_RETURN_TO_LAUNCH, lat_e7=0, lon_e7=0)
    items[9] = replace(items[9], command=Command.NAV_LAND, lat_e7=0, lon_e7=0, alt_m=0.0)
    return items


#: The rules for coordinates sent in single precision.
RULES = HarakiriRules(is_single_precision=True)


def holds(world: World, items: list[MissionItem]) -> bool:
    """True if the board's list equals these items after the rules."""
    read = [each._replace(lat_e7=readable_e7(each.lat_e7), lon_e7=readable_e7(each.lon_e7)) for each in world.stored]
    return tuple(read) == check_list(items, RULES).records


def near(one: int | None, other: int | None) -> bool:
    return abs((one or 0) - (other or 0)) <= 40


@pytest.mark.parametrize("items", [waypoints(2), mixed(), waypoints(146)], ids=["2", "mixed", "146"])
def test_a_list_is_written_verified_and_accepted(items: list[MissionItem]) -> None:
    world, station = mavlink_only()
    assert Upload(station, items).run() is A.ACCEPTED
    assert holds(world, items)
    read = Download(station).run()
    assert read is not None
    for sent, got in zip(check_list(items, HarakiriRules()).items, read, strict=True):
        assert near(sent.lat_e7, got.lat_e7)
        assert near(sent.lon_e7, got.lon_e7)
        assert replace(got, lat_e7=sent.lat_e7, lon_e7=sent.lon_e7) == sent
    assert any(re.fullmatch(r"Places moved by up to 0\.[1-4] m \(single precision\)", text) for text in station.texts())
    world.assert_line_was_clean()


def test_an_earlier_list_is_read() -> None:
    world, station = mavlink_only()
    assert Upload(station, mixed()).run() is A.ACCEPTED
    world.unplug()
    world.plug()
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 8)
    world.wait_until(lambda w: w.bridge.vehicle.armed is False, 8)
    read = Download(station).run()
    assert read is not None
    # The region of interest, too, is returned as sent: the list is recognised.
    assert [item.command for item in read] == [item.command for item in mixed()]


def test_an_empty_list_clears_the_board() -> None:
    world, station = mavlink_only()
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED
    assert Upload(station, []).run() is A.ACCEPTED
    assert world.stored == ()
    (home,) = Download(station).run()
    assert (home.seq, home.command) == (0, 16)
    assert (home.lat_e7, home.lon_e7) == world.bridge.vehicle.place()


def test_an_upload_while_armed_is_denied() -> None:
    world, station = mavlink_only()
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED
    world.faults.armed = True
    world.run(4)
    assert Upload(station, waypoints(6)).run() is A.DENIED
    assert holds(world, waypoints(5))


@pytest.mark.parametrize("hazard", [0x0D, 0x23, 0x52])
def test_a_list_with_hazard_bytes_is_refused(hazard: int) -> None:
    world, station = mavlink_only()
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED
    degrees = trapped_degrees(hazard)
    items = waypoints(6)
    items[3] = replace(items[3], lat_e7=round(degrees * 1e7))
    assert Upload(station, items).run() is A.DENIED
    assert any("firmware bug" in text for text in station.texts())
    assert holds(world, waypoints(5))
    world.assert_line_was_clean()


def trapped_degrees(hazard: int) -> float:
    """A latitude whose single-precision bytes have three hazard bytes in a row."""

    for high in range(256):
        (degrees,) = struct.unpack("<f", bytes((hazard, hazard, hazard, high)))
        if 1 <= abs(degrees) <= 89:
            return float(degrees)
    # Not possible with the exponent's bytes: the run begins in the previous field.
    raise AssertionError(hazard)


@pytest.mark.parametrize("rate", [3e-4, 1e-3])
def test_the_reported_result_is_true_on_a_bad_line(rate: float) -> None:
    outcomes = set()
    for seed in range(6):
        world, station = mavlink_only(seed=seed)
        assert Upload(station, waypoints(5)).run() is A.ACCEPTED
        world.faults.lost_byte_rate = rate
        result = Upload(station, waypoints(30, 1), tries=40).run()
        world.faults.lost_byte_rate = 0.0
        outcomes.add(result)
        world.run(3)
        if result is A.ACCEPTED:
            assert holds(world, waypoints(30, 1))
        elif not any("Link lost while writing" in text for text in station.texts()):
            assert holds(world, waypoints(5))
    assert A.ACCEPTED in outcomes


def test_a_list_lost_with_the_configuration_in_a_power_cut_is_reported() -> None:
    world, station = mavlink_only()
    assert Upload(station, waypoints(5)).run() is A.ACCEPTED
    world.faults.power_cut_at_flash_operation = 2
    assert Upload(station, waypoints(4, 1)).run() is A.DENIED
    world.power_on()
    world.wait_until(lambda w: station.texts()[-1] == "The mission arrived incomplete: write it again", 30)
    assert world.store.outcomes() == [Outcome.VERIFIED, Outcome.FAILED]
    assert not world.stored


@pytest.mark.parametrize("x", [math.nan, math.inf, 3e38, -300.0])
@pytest.mark.parametrize("z", [math.nan, 1e9, 20.0])
def test_an_item_with_impossible_values_ends_the_reading(x: float, z: float) -> None:
    """An intact frame of a faulty board."""
    world, station = mavlink_only()
    assert Upload(station, mixed()).run(20) is A.ACCEPTED
    wrong = messages.MAVLink_mission_item_message(255, 190, 1, 3, 16, 0, 1, 0, 2, 0, 0, x, 8.4, z)
    frame = bytes(wrong.pack(messages.MAVLink(None, srcSystem=1, srcComponent=200), force_mavlink1=True))
    answers: list[HeldMission | Refusal] = []
    world.bridge.missions.pull(answers.append, world.now)
    end = world.now + 30
    while not answers and world.now < end:
        world.run(0.01)
        world.bridge.fc_received(frame, world.now)
    assert answers
    assert not world.events("fc.lost")


def test_for_an_unpatched_harakiri_on_msp_the_pilot_learns_the_reason() -> None:
    faults = Faults(extension=False)
    world = World(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), faults, speeds=(115200,))
    world.wait_until(lambda w: w.kind is harakiri.UNPATCHED, 8)
    station = GroundStation(world)
    assert Upload(station, waypoints(5)).run() is A.UNSUPPORTED


@example(3384)
@given(st.integers(-1_800_000_000, 1_800_000_000) | st.integers(-20_000_000, 20_000_000) | st.integers(-1000, 1000))
def test_a_position_read_from_the_board_is_written_back_unchanged(value_e7: int) -> None:
    readable = readable_e7(value_e7)
    assert readable_e7(readable) == readable
    degrees = abs(value_e7) / 1e7
    assert abs(readable - value_e7) <= (38 if degrees < 64 else 128)


@pytest.mark.parametrize(("is_there", "outcome"), [(True, Outcome.VERIFIED), (False, Outcome.FAILED)])
def test_a_mission_left_pending_by_a_killed_daemon_is_settled_in_mavlink_mode(is_there: bool, outcome: Outcome) -> None:
    flash = memoryview(bytearray(b"\xff") * flash_size(SimOptions()))
    _, station = mavlink_only(flash=flash)
    assert Upload(station, waypoints(12, seed=0 if is_there else 1)).run() is A.ACCEPTED
    verdict = check_list(waypoints(12), RULES)
    world, station = mavlink_only(flash=flash, pending=ArrivedMission("udp", tuple(waypoints(12)), verdict))
    world.wait_until(lambda w: w.store.outcomes() != [None], 20)
    assert world.store.outcomes() == [outcome]
