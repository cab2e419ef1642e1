# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated Betaflight and baseflight: their reply lengths, and no missions."""

import struct

import pytest

from simulator.board.options import Faults
from tests.support.msp_bench import MspBench, waypoint

LENGTHS = {
    "betaflight": {1: 3, 2: 4, 3: 3, 101: 24, 102: 18, 105: 32, 108: 6, 109: 6, 110: 9, 116: 200, 119: 18},
    "baseflight": {100: 7, 101: 11, 102: 18, 105: 16, 106: 16, 107: 5, 108: 6, 109: 6, 110: 7},
}
KINDS = tuple(LENGTHS)


@pytest.mark.parametrize("kind", KINDS)
def test_replies_have_the_firmwares_lengths(kind: str) -> None:
    bench = MspBench(kind)
    assert {command: len(bench.payload(command)) for command in LENGTHS[kind]} == LENGTHS[kind]


@pytest.mark.parametrize("command", [106, 107])
def test_a_betaflight_without_gps_lacks_gps_messages(command: int) -> None:
    frame = MspBench("betaflight").ask(command)
    assert frame is not None
    assert frame.direction == "!"


def test_betaflights_first_uart_of_eight_has_msp_in_either_version() -> None:
    bench = MspBench("betaflight")
    ports = [struct.unpack_from("<BHBBBB", bench.payload(54), 7 * place) for place in range(8)]
    assert ports == [(uart, uart == 0, 5, 4, 0, 5) for uart in range(8)]
    wide = bench.payload_v2(0x1009)
    assert [wide[0], *(struct.unpack_from("<BIBBBB", wide, 1 + 9 * place) for place in range(8))] == [8, *ports]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("command", "payload"), [(18, b"\0"), (19, b"\0"), (20, b""), (121, b""), (122, b"")])
def test_mission_requests_are_errors(kind: str, command: int, payload: bytes) -> None:
    frame = MspBench(kind).ask(command, payload)
    assert frame is not None
    assert frame.direction == "!"


def test_betaflight_refuses_waypoints_and_baseflight_holds_at_any() -> None:
    refused, taken = (MspBench(kind).ask(209, waypoint(1).pack(1)) for kind in KINDS)
    assert refused is not None
    assert taken is not None
    assert (refused.direction, taken.direction) == ("!", ">")
    assert len(MspBench("baseflight").payload(118, b"\x01")) == 18


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("armed", [False, True])
def test_the_arm_flag_is_at_the_index_of_arm_in_the_names(kind: str, armed: bool) -> None:
    bench = MspBench(kind, faults=Faults(armed=armed))
    bench.run(0.5)
    names = bench.payload(116).split(b";")
    assert len(names) == len(bench.payload(119)) + 1
    flags = struct.unpack_from("<I", bench.payload(101), 6)[0]
    assert bool(flags >> names.index(b"ARM") & 1) is armed


@pytest.mark.parametrize(("kind", "lowest"), [("betaflight", 0), ("baseflight", -180)])
def test_the_heading_turns_in_flight(kind: str, lowest: int) -> None:
    bench = MspBench(kind, faults=Faults(armed=True))
    headings = []
    for _ in range(80):
        bench.run(1)
        headings.append(struct.unpack("<hhh", bench.payload(108))[2])
    assert lowest <= min(headings) < lowest + 10
    assert lowest + 350 < max(headings) < lowest + 360
