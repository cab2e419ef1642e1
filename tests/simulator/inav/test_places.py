# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated INAV's geozones: special cases as observed on INAV's own simulators."""

import struct

from protocols.msp.frame import Direction, MspParser, request
from protocols.msp.inav_places import (
    APPROACHES,
    FW_APPROACH,
    GEOZONE_VERTEX,
    SET_FW_APPROACH,
    SET_GEOZONE,
    SET_GEOZONE_VERTEX,
    FwApproach,
    decode_approach,
)
from protocols.msp.nav import LAST, Nav
from tests.support.msp_bench import MspBench

CIRCLE = struct.pack("<BBBiiBBB", 3, 0, 0, 0, 0, 0, 0, 2)
CENTRE = struct.pack("<BBii", 3, 0, 453838000, 84733000)


def with_circle() -> MspBench:
    bench = MspBench("inav")
    assert bench.payload_v2(SET_GEOZONE, CIRCLE) == b""
    return bench


def test_a_circle_set_without_a_radius_gets_bytes_of_an_earlier_request() -> None:
    bench = with_circle()
    assert bench.payload_v2(SET_GEOZONE_VERTEX, CENTRE) == b""
    assert bench.payload_v2(GEOZONE_VERTEX, b"\3\0") == CENTRE + CIRCLE[10:14]


def test_the_error_to_a_circle_without_a_radius_has_the_centre() -> None:
    bench = with_circle()
    assert bench.payload_v2(SET_GEOZONE_VERTEX, CENTRE + struct.pack("<i", 5000)) == b""
    bench.send(request(GEOZONE_VERTEX, b"\3\1"))
    (frame,) = MspParser().feed(bench.run(0.2))
    assert (frame.direction, frame.payload) == (Direction.ERROR, struct.pack("<BBii", 3, 1, 5000, 0))


def test_writing_waypoints_erases_approaches() -> None:
    """After each mission of three waypoints since the boot, as 7.1.0, 8.0.1, 9.0.1 and 9.1.0 do."""
    bench = MspBench("inav")
    for number in range(APPROACHES):
        assert bench.payload_v2(SET_FW_APPROACH, FwApproach(number, approach_cm=100).pack()) == b""
    left = []
    for _ in range(9):
        for number, flag in enumerate((0, 0, LAST), 1):
            waypoint = struct.pack("<BBiiihhhB", number, 1, 453838000, 84733000, 5000, 0, 0, 0, flag)
            assert bench.payload_v2(Nav.SET_WP, waypoint) == b""
        read = [decode_approach(bench.payload_v2(FW_APPROACH, bytes((number,)))) for number in range(APPROACHES)]
        left.append("".join("." if each is None or each.is_empty else "x" for each in read))
    assert left == ["x" * 8 + "." * size + "x" * (9 - size) for size in range(2, 10)] + ["." * 17]
