# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated INAV has every hazard of docs/inav.md, as observed on INAV's own simulator."""

import struct
from collections.abc import Iterable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.frame import request
from protocols.msp.nav import NavAction
from simulator.board.msp_options import MspOptions
from simulator.board.nav_waypoint import FLAG_LAST, NavWaypoint
from simulator.board.options import Faults
from simulator.board.simulated_board import Power
from tests.support.msp_bench import GETINFO, LOAD, SAVE, SET_WP, WP, MspBench, waypoint

VERSIONS = ("6.1.1", "7.1.2", "8.0.1", "9.0.1", "9.1.0")
FAKE = NavWaypoint(NavAction.RTH, 0, 0, 0, 0, 0, 0, FLAG_LAST)
THREE = [waypoint(0), waypoint(1), waypoint(2)]
NAV_WP_BIT = 13  # of 9.1.0's BOXIDS
RC = 105
SELECTED = b"nav_wp_multi_mission_index\0"


def test_a_list_is_stored_and_read_back() -> None:
    bench = MspBench("inav")
    assert bench.info() == (120, False, 0)
    bench.upload(THREE)
    assert bench.info() == (120, True, 3)
    assert [bench.read(number) for number in (1, 2, 3)] == [*THREE[:2], replace(THREE[2], flag=FLAG_LAST)]


def test_the_example_of_the_specification_is_acknowledged() -> None:
    bench = MspBench("inav")
    bench.send(bytes.fromhex("244d3c15d101018768111ff99254ff88130000000000000000007e"))
    assert bench.run(0.1).hex() == "244d3e00d1d1"
    assert bench.read(1).lat_e7 == 521234567


@pytest.mark.parametrize(
    ("number", "wrong"),
    [
        (5, waypoint(9)),  # a gap
        (2, waypoint(9)),  # written already
        (4, waypoint(9, action=2)),  # POSHOLD_UNLIM
        (4, waypoint(9, action=0)),
        (4, waypoint(9, action=9)),
        (0, waypoint(9)),
        (121, waypoint(9)),
        (255, waypoint(9)),
    ],
)
def test_records_that_are_acknowledged_but_not_stored(number: int, wrong: NavWaypoint) -> None:
    bench = MspBench("inav")
    bench.upload(THREE)
    bench.write(number, wrong)
    assert bench.info() == (120, True, 3)
    assert bench.read(2) == THREE[1]


@pytest.mark.parametrize(
    ("numbers", "last", "is_valid", "count"),
    [
        ((1, 2, 3, 1), 3, False, 1),  # record 1 clears the list
        ((1, 2, 3, 1, 2), 2, True, 2),
        ((1, 2, 2, 3, 3), 0, False, 3),  # repeated
        (range(1, 122), 0, False, 120),  # the capacity
        ((1, 2), 1, False, 2),  # a second mission, which has begun
        ((1, 2, 3), 3, True, 3),
    ],
)
def test_count_and_validity_follow_the_records(numbers: Iterable[int], last: int, is_valid: bool, count: int) -> None:
    bench = MspBench("inav")
    for number in numbers:
        bench.write(number, waypoint(number, flag=FLAG_LAST if number == last else 0))
    assert bench.info() == (120, is_valid, count)
    assert bench.read(count).lat_e7 == waypoint(count).lat_e7


@pytest.mark.parametrize("number", [4, 120, 121, 200, 254])
def test_reading_past_the_end_gives_a_fake_waypoint(number: int) -> None:
    bench = MspBench("inav")
    bench.upload(THREE)
    assert bench.read(number) == FAKE


@pytest.mark.parametrize("size", [0, 20, 22])
def test_a_waypoint_of_another_size_is_an_error(size: int) -> None:
    frame = MspBench("inav").ask(SET_WP, bytes(size))
    assert frame is not None
    assert frame.direction == "!"


# -- the EEPROM ------------------------------------------------------------------------------------------------


def answer(bench: MspBench, command: int, payload: bytes = b"\0") -> str:
    frame = bench.ask(command, payload)
    assert frame is not None
    return frame.direction


@pytest.mark.parametrize("command", [SAVE, LOAD])
@pytest.mark.parametrize("size", [0, 2])
def test_save_and_load_need_a_payload_of_one_byte(command: int, size: int) -> None:
    bench = MspBench("inav")
    bench.upload(THREE)
    assert answer(bench, SAVE) == ">"
    assert answer(bench, command, bytes(size)) == "!"


def test_after_a_restart_a_saved_list_has_to_be_loaded() -> None:
    bench = MspBench("inav")
    bench.upload(THREE)
    assert answer(bench, SAVE) == ">"
    bench.restart()
    assert bench.info() == (120, False, 0)
    assert bench.read(1) == FAKE
    assert answer(bench, LOAD) == ">"
    assert bench.info() == (120, True, 3)
    assert bench.read(2) == THREE[1]


def test_only_a_whole_list_is_saved_and_only_a_saved_list_loaded() -> None:
    bench = MspBench("inav")
    assert answer(bench, SAVE) == answer(bench, LOAD) == "!"
    bench.write(1, waypoint(1))
    assert answer(bench, SAVE) == "!"
    bench.upload(THREE)
    assert answer(bench, LOAD) == ">", "RAM has a list"
    assert bench.info() == (120, True, 3)


@given(
    st.lists(
        st.builds(
            NavWaypoint,
            st.sampled_from((1, 3, 4, 5, 7, 8)),
            *[st.integers(-(2**31), 2**31 - 1)] * 3,
            *[st.integers(-(2**15), 2**15 - 1)] * 3,
            st.sampled_from((0, 0x48)),
        ),
        min_size=1,
        max_size=12,
    )
)
def test_any_saved_list_survives_a_restart(waypoints: list[NavWaypoint]) -> None:
    bench = MspBench("inav")
    bench.upload(waypoints)
    assert answer(bench, SAVE) == ">"
    bench.restart()
    assert answer(bench, LOAD) == ">"
    assert bench.info() == (120, True, len(waypoints))
    held = [bench.read(number) for number in range(1, len(waypoints) + 1)]
    assert held == [*waypoints[:-1], replace(waypoints[-1], flag=FLAG_LAST)]


# -- JUMP --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("p1", [0, -1, -32767])
@pytest.mark.parametrize("version", VERSIONS)
def test_an_invalid_jump_is_acknowledged_and_crashes_the_board(version: str, p1: int) -> None:
    bench = MspBench("inav", MspOptions(version=version))
    bench.upload(THREE)
    bench.write(1, waypoint(0))
    bench.write(2, waypoint(action=NavAction.JUMP, p1=p1))
    assert bench.board.power is Power.CRASHED
    assert not bench.board.is_alive
    assert bench.ask(GETINFO, timeout=5.0) is None
    bench.restart()
    assert bench.info() == (120, False, 0)
    assert bench.board.counters.crashes == 1


@pytest.mark.parametrize(
    ("jump", "arms"),
    [
        ({"p1": 1, "p2": -1}, True),
        ({"p1": 2, "p2": 0}, True),
        ({"p1": 3, "p2": 1}, False),  # the waypoint before it
        ({"p1": 4, "p2": 1}, False),  # itself
        ({"p1": 5, "p2": 1}, False),  # the next
        ({"p1": 6, "p2": 1}, False),  # no such waypoint
        ({"p1": 1, "p2": -2}, False),
    ],
)
def test_an_invalid_jump_blocks_arming(jump: dict[str, int], arms: bool) -> None:
    bench = MspBench("inav")
    bench.upload([*THREE, waypoint(action=NavAction.JUMP, **jump), waypoint(4)])
    bench.faults.armed = True
    bench.run(1.0)
    assert bench.board.armed is arms


# -- armed -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_while_armed_version_7_ignores_writes_and_8_stores_them(version: str) -> None:
    bench = MspBench("inav", MspOptions(version=version))
    bench.upload(THREE)
    bench.faults.armed = True
    bench.run(0.5)
    bench.write(1, waypoint(9))
    assert bench.info() == ((120, True, 3) if version[0] < "8" else (120, False, 1))


def test_version_9_ignores_writes_during_a_mission() -> None:
    bench = MspBench("inav", faults=Faults(armed=True, boxes=0))
    bench.upload([waypoint(100), waypoint(200)])
    bench.faults.boxes = 1 << NAV_WP_BIT
    bench.run(1.0)
    bench.write(1, waypoint(9))
    assert bench.info() == (120, True, 2)
    bench.faults.boxes = 0
    bench.run(1.0)
    bench.write(1, waypoint(9))
    assert bench.info() == (120, False, 1)


@pytest.mark.parametrize("command", [SAVE, LOAD])
def test_save_and_load_are_errors_while_armed(command: int) -> None:
    bench = MspBench("inav")
    bench.upload(THREE)
    assert answer(bench, SAVE) == ">"
    bench.faults.armed = True
    bench.run(0.5)
    assert answer(bench, command) == "!"


# -- several missions in one store -------------------------------------------------------------------------------


def several() -> MspBench:
    """Three missions of one, two and three waypoints, saved and loaded."""
    bench = MspBench("inav", faults=Faults(boxes=0))
    ends = (1, 3, 6)
    for number in range(1, 7):
        bench.write(number, waypoint(10 * number, flag=FLAG_LAST if number in ends else 0))
    assert (answer(bench, SAVE), answer(bench, LOAD)) == (">", ">")
    return bench


def test_all_missions_are_counted_while_disarmed_but_one_while_armed() -> None:
    bench = several()
    bench.set("nav_wp_max_safe_distance", 0)
    assert bench.info() == (120, True, 6)
    bench.faults.selected_mission = 3
    bench.faults.armed = True
    bench.run(0.5)
    assert bench.info() == (120, True, 3)
    assert [bench.read(number) for number in (1, 2, 3)] == [
        waypoint(40),
        waypoint(50),
        waypoint(60, flag=FLAG_LAST),
    ]


def test_the_selected_mission_is_a_setting_that_save_resets() -> None:
    bench = several()
    bench.faults.selected_mission = 2
    assert bench.payload_v2(0x1003, SELECTED) == b"\2"
    bench.faults.selected_mission = 0
    assert answer(bench, SAVE) == ">"
    assert bench.payload_v2(0x1003, SELECTED) == b"\1"


def test_a_new_list_erases_the_others_with_the_next_save() -> None:
    bench = several()
    bench.upload([waypoint(70)])
    assert answer(bench, SAVE) == ">"
    bench.restart()
    assert answer(bench, LOAD) == ">"
    assert bench.info() == (120, True, 1)


def test_the_sticks_load_the_saved_missions() -> None:
    bench = several()
    bench.restart()
    assert bench.info() == (120, False, 0)
    bench.faults.stick_loads += 1
    channels = struct.unpack("<4H", bench.payload(RC)[:8])
    assert channels == (2000, 2000, 1500, 1000)
    bench.run(0.4)
    assert bench.info() == (120, False, 0)
    bench.run(0.4)
    assert bench.info() == (120, True, 6)
    assert struct.unpack("<4H", bench.payload(RC)[:8]) == (1500, 1500, 1500, 1000)


# -- the port ----------------------------------------------------------------------------------------------------


def test_120_frames_at_once_overrun_the_ring() -> None:
    """INAV's own simulator has a ring of 2048 bytes, which keeps the last 44 of 120 frames."""
    bench = MspBench("inav", MspOptions(baud=None, ring_size=2048))
    bench.send(b"".join(request(WP, waypoint(n).pack(n)) for n in range(1, 121)))
    assert bench.run(2.0).count(b"$M>") == 44


def test_half_a_frame_swallows_the_next_requests_at_any_time() -> None:
    bench = MspBench("inav")
    bench.send(request(SET_WP, bytes(21))[:10])
    bench.run(60.0)
    # 16 payload bytes and the checksum are missing: two requests of 6 bytes supply 12, the third 5.
    for _ in range(3):
        assert bench.ask(GETINFO) is None
    assert bench.info() == (120, False, 0)


@pytest.mark.parametrize(
    ("sent", "armed", "enters"),
    [
        (b"#", False, True),
        (b"#" + request(GETINFO), False, False),
        (request(SET_WP, waypoint(lat_e7=0x23232323).pack(1)), False, False),
        (b"#", True, False),
    ],
)
def test_only_a_lone_number_sign_on_the_ground_opens_the_cli(sent: bytes, armed: bool, enters: bool) -> None:
    bench = MspBench("inav", faults=Faults(armed=armed))
    bench.run(0.2)
    bench.send(sent)
    assert (b"CLI" in bench.run(1.0)) is enters
    assert (bench.ask(GETINFO) is None) is enters
    assert bool(bench.board.counters.cli_entered) is enters


@pytest.mark.parametrize("version", VERSIONS)
def test_a_single_r_starts_the_bootloader_up_to_8_0_1(version: str) -> None:
    bench = MspBench("inav", MspOptions(version=version))
    bench.send(b"R")
    bench.run(0.5)
    falls = version < "9"
    assert bench.board.counters.bootloader_entered is falls
    assert (bench.ask(GETINFO) is None) is falls


@given(st.binary(max_size=300))
def test_the_board_survives_any_input(data: bytes) -> None:
    bench = MspBench("inav")
    bench.send(data)
    bench.run(1.0)
    bench.restart()
    assert bench.info()[0] == 120
