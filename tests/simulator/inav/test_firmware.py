# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated INAV's telemetry: lengths and signs of each version, as observed on INAV's own simulators."""

import struct

import pytest

from protocols.msp.frame import MspParser, request
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from tests.support.msp_bench import MspBench, waypoint

VERSIONS = ("6.1.1", "7.1.2", "8.0.1", "9.0.1", "9.1.0")
LENGTHS = {
    1: 3,
    2: 4,
    3: 3,
    20: 4,
    101: 11,
    102: 18,
    104: 16,
    106: 18,
    107: 5,
    108: 6,
    109: 10,
    110: 7,
    121: 7,
    150: 16,
}
BOXES = {"6.1.1": (29, 300), "7.1.2": (35, 387), "8.0.1": (37, 426), "9.0.1": (38, 442), "9.1.0": (38, 442)}


@pytest.mark.parametrize("version", VERSIONS)
def test_replies_have_the_lengths_of_each_version(version: str) -> None:
    bench = MspBench("inav", MspOptions(version=version))
    assert {command: len(bench.payload(command)) for command in LENGTHS} == LENGTHS
    assert (len(bench.payload(119)), len(bench.payload(116))) == BOXES[version]


def test_the_identity_names_inav_and_the_version() -> None:
    bench = MspBench("inav", MspOptions(version="7.1.2"))
    assert (bench.payload(1), bench.payload(2), bench.payload(3)) == (b"\x00\x02\x05", b"INAV", b"\x07\x01\x02")


@pytest.mark.parametrize("command", [100, 112, 122, 199, 253])
def test_unknown_requests_are_errors(command: int) -> None:
    frame = MspBench("inav").ask(command)
    assert frame is not None
    assert (frame.direction, frame.command, frame.payload) == ("!", command, b"")


@pytest.mark.parametrize("version", VERSIONS)
def test_the_mode_names_need_a_jumbo_frame(version: str) -> None:
    bench = MspBench("inav", MspOptions(version=version))
    names = bench.payload(116).split(b";")
    assert bytes(bench.received[3:5]) == b"\xff\x74"
    assert len(names) == len(bench.payload(119)) + 1


@pytest.mark.parametrize(
    ("version", "receiver", "channels"), [("7.1.2", True, 18), ("8.0.1", True, 34), ("9.1.0", False, 0)]
)
def test_the_number_of_channels_depends_on_the_version(version: str, receiver: bool, channels: int) -> None:
    bench = MspBench("inav", MspOptions(version=version, receiver=receiver))
    assert len(bench.payload(105)) == 2 * channels


def test_msp_v2_works_alongside_v1() -> None:
    """Lengths as observed on INAV 9.1.0's own simulator."""
    bench = MspBench("inav", MspOptions(platform=1, pitot=True), Faults(arming_blockers=1 << 18))
    lengths = {command: len(bench.payload_v2(command)) for command in (5, 0x2000, 0x2002, 0x2009, 0x2010)}
    assert lengths == {5: 27, 0x2000: 22, 0x2002: 24, 0x2009: 4, 0x2010: 9}
    assert struct.unpack_from("<I", bench.payload_v2(0x2000), 9)[0] == 1 << 18
    assert bench.payload_v2(0x2010)[3] == 1
    assert bench.payload(2) == b"INAV"


@pytest.mark.parametrize(
    ("version", "status", "mixer", "ez_tune"),
    [
        ("6.1.1", 21, "0000000000ffff0c10", 0),
        ("7.1.2", 22, "0000000000ffff0c10", 10),
        ("8.0.1", 22, "0000010000ffff0c12", 11),
    ],
)
def test_msp_v2_replies_of_each_version(version: str, status: int, mixer: str, ez_tune: int) -> None:
    bench = MspBench("inav", MspOptions(version=version))
    assert (len(bench.payload_v2(0x2000)), bench.payload_v2(0x2010).hex()) == (status, mixer)
    bench.send(request(0x2070))
    (frame,) = MspParser().feed(bench.run(0.2))
    assert len(frame.payload) == ez_tune


def test_a_truncated_v2_frame_swallows_the_next_request() -> None:
    bench = MspBench("inav")
    bench.send(request(0x2000)[:8])
    assert bench.ask(2) is None
    assert bench.payload(2) == b"INAV"


@pytest.mark.parametrize("armed", [False, True])
def test_the_arm_flag_is_at_the_index_of_box_id_0(armed: bool) -> None:
    bench = MspBench("inav", faults=Faults(armed=armed))
    bench.run(0.2)
    flags = struct.unpack_from("<I", bench.payload(101), 6)[0]
    assert bool(flags >> bench.payload(119).index(0) & 1) is armed


def test_boxes_beyond_bit_32_are_not_reported() -> None:
    bench = MspBench("inav", faults=Faults(boxes=1 << 36 | 1 << 4))
    assert struct.unpack_from("<I", bench.payload(101), 6)[0] == 1 << 4


def test_home_and_position_have_their_altitude_above_sea_level() -> None:
    bench = MspBench("inav")
    for number in (0, 255):
        place = bench.read(number)
        assert (place.lat_e7, place.lon_e7, place.alt_cm) == (453838000, 84733000, 13100)


def test_home_is_the_place_of_arming() -> None:
    bench = MspBench("inav", faults=Faults(boxes=0))
    bench.set("nav_wp_max_safe_distance", 0)
    bench.upload([waypoint(100)])
    bench.faults.armed, bench.faults.boxes = True, 1 << 13
    bench.run(60)
    assert bench.read(0).lat_e7 == 453838000
    assert bench.read(255).lat_e7 > 453838000 + 10000


def test_a_waypoint_request_without_a_number_returns_home() -> None:
    assert MspBench("inav").payload(118)[0] == 0


def test_replies_arrive_at_line_rate() -> None:
    bench = MspBench("inav", MspOptions(baud=9600, serial_task_ms=10))
    bench.payload(106)
    # 6 bytes out, the task's delay, 24 bytes back.
    assert bench.now == pytest.approx(30 * 10 / 9600, abs=0.011)
