# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated MultiWii 2.4.1 with navigation: each waypoint is written directly to the EEPROM."""

import struct

import pytest

from protocols.msp.nav import NavAction
from simulator.board.msp_options import MspOptions
from simulator.board.nav_waypoint import FLAG_LAST
from simulator.board.options import Faults
from tests.support.msp_bench import SET_WP, WP, MspBench, waypoint

LENGTHS = {
    100: 7,
    101: 11,
    102: 18,
    104: 16,
    105: 16,
    106: 16,
    107: 5,
    108: 6,
    109: 6,
    110: 7,
    119: 12,
    121: 7,
    122: 22,
}
MISSION, RETURN = 1 << 10, 1 << 7
CRC_ERROR, IN_PROGRESS = 0xFE, 0xFF
DISARMED = 10
PID, SET_PID = 112, 202


def test_replies_have_multiwiis_lengths() -> None:
    bench = MspBench("multiwii")
    assert {command: len(bench.payload(command)) for command in LENGTHS} == LENGTHS
    version, _, _, capability = struct.unpack("<BBBI", bench.payload(100))
    assert (version, capability >> 4 & 1) == (241, 1)


@pytest.mark.parametrize("command", [1, 2, 3, 18, 19, 20])
def test_requests_only_inav_knows_are_errors(command: int) -> None:
    frame = MspBench("multiwii").ask(command, b"\0")
    assert frame is not None
    assert frame.direction == "!"


def test_the_capacity_is_in_the_navigation_settings() -> None:
    assert MspBench("multiwii", MspOptions(capacity=30)).payload(122)[-2] == 30


def test_a_waypoint_survives_a_restart() -> None:
    bench = MspBench("multiwii")
    bench.upload([waypoint(1), waypoint(2)])
    bench.restart()
    assert [bench.read(number) for number in (1, 2)] == [waypoint(1), waypoint(2, flag=FLAG_LAST)]
    assert len(bench.board.stored_records) == 2


def test_a_record_never_written_has_a_wrong_checksum() -> None:
    bench = MspBench("multiwii", MspOptions(capacity=30))
    bench.write(31, waypoint(1))
    assert {bench.read(number).flag for number in (1, 30, 31)} == {CRC_ERROR}


def test_waypoints_may_be_written_in_any_order_and_the_rest_is_kept() -> None:
    bench = MspBench("multiwii")
    for number in (3, 1, 2, 1):
        bench.write(number, waypoint(number))
    assert [bench.read(number) for number in (1, 2, 3)] == [waypoint(1), waypoint(2), waypoint(3)]


def test_the_acknowledgement_waits_for_the_eeprom() -> None:
    bench = MspBench("multiwii")
    bench.write(1, waypoint(1))
    assert bench.now > 0.06


def test_blank_records_are_returned_even_above_the_capacity() -> None:
    bench = MspBench("multiwii")
    assert status(bench) == (0, 0, 0, 0, DISARMED)
    for number in (3, 254):
        assert bench.read(number).pack(number) == bytes((number, *b"\xff" * 19, 0xFE))
        assert status(bench) == (0, 0, 255, 255, DISARMED)


def flying() -> MspBench:
    bench = MspBench("multiwii", faults=Faults(boxes=0))
    bench.upload([waypoint(10), waypoint(20, NavAction.POSHOLD_TIME, p1=5), waypoint(30), waypoint(action=4, p1=1)])
    bench.faults.armed, bench.faults.boxes = True, MISSION
    bench.run(2)
    return bench


def status(bench: MspBench) -> tuple[int, ...]:
    return struct.unpack("<5Bh", bench.payload(121))[:5]


@pytest.mark.parametrize(("p1", "state"), [(0, 3), (7, 10)])
def test_a_return_home_lands_if_the_waypoint_read_last_has_p1(p1: int, state: int) -> None:
    bench = MspBench("multiwii", faults=Faults(boxes=0))
    bench.upload([waypoint(1, NavAction.POSHOLD_TIME, p1=p1), waypoint(2)])
    assert bench.read(1).p1 == p1
    bench.faults.armed, bench.faults.boxes = True, RETURN
    bench.run(60)
    assert status(bench)[:2] == (2, state)


def test_an_empty_setter_takes_the_bytes_that_an_earlier_request_left() -> None:
    """`read8()` in s_struct_w does not look at the payload's size."""
    bench = MspBench("multiwii")
    bench.payload(WP, bytes(range(100, 130)))
    assert bench.payload(SET_PID) == b""
    assert bench.payload(PID)[:30] == bytes(range(100, 130))


def test_during_a_mission_writes_are_unanswered_and_reads_empty() -> None:
    bench = flying()
    assert status(bench)[:2] == (3, 5)
    assert bench.ask(SET_WP, waypoint(9).pack(1)) is None
    record = bench.read(2)
    assert (record.action, record.flag) == (0, IN_PROGRESS)
    bench.faults.armed = False
    bench.run(1)
    assert bench.read(1) == waypoint(10)


@pytest.mark.parametrize(("target", "error"), [(3, 6), (0, 6), (-1, 6), (1, 4)])
def test_a_jump_goes_back_or_ends_the_mission(target: int, error: int) -> None:
    bench = MspBench("multiwii", faults=Faults(boxes=0))
    bench.upload([waypoint(5), waypoint(9), waypoint(action=NavAction.JUMP, p1=target, p2=1)])
    bench.faults.armed, bench.faults.boxes = True, MISSION
    bench.run(120)
    assert status(bench)[4] == error


def flown_numbers(bench: MspBench, seconds: float) -> list[int]:
    """The waypoint numbers in the order they were active."""
    bench.faults.armed, bench.faults.boxes = True, MISSION
    numbers: list[int] = []
    end = bench.now + seconds
    while bench.now < end:
        bench.run(0.25)
        number = status(bench)[3]
        if numbers[-1:] != [number]:
            numbers.append(number)
    return numbers


@pytest.mark.parametrize(("hold", "seconds"), [(65, 65), (66, 0.5), (70, 4.5)])
def test_a_hold_is_counted_in_16_bits(hold: int, seconds: float) -> None:
    bench = MspBench("multiwii", faults=Faults(boxes=0))
    bench.upload([waypoint(0, NavAction.POSHOLD_TIME, p1=hold), waypoint(5)])
    bench.faults.armed, bench.faults.boxes = True, MISSION
    while status(bench)[1] != 4:
        bench.run(0.05)
    began = bench.now
    while status(bench)[3] != 2:
        bench.run(0.05)
    assert bench.now - began == pytest.approx(seconds, abs=0.5)


@pytest.mark.parametrize(("alt_cm", "height_m"), [(0, 20), (5000, 50)])
def test_a_return_home_has_a_minimum_height(alt_cm: int, height_m: int) -> None:
    bench = MspBench("multiwii", faults=Faults(boxes=0))
    bench.upload([waypoint(5, alt_cm=1000), waypoint(action=NavAction.RTH, alt_cm=alt_cm)])
    flown_numbers(bench, 120)
    truth = bench.board.truth(bench.now)
    assert truth is not None
    assert truth.flight.height_m == pytest.approx(height_m, abs=0.5)
