# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated INAV's geozones: special cases as observed on INAV's own simulators."""

import struct

from protocols.msp.frame import Direction, MspParser, request
from protocols.msp.inav_places import GEOZONE_VERTEX, SET_GEOZONE, SET_GEOZONE_VERTEX
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
