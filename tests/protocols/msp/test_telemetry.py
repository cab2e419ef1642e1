# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry replies: Harakiri's lengths are the minimum, other firmware sends more, and shorter ones are dropped."""

import struct
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp import telemetry as t

#: Each decoder and Harakiri's reply, the shortest one accepted.
LEAST: list[tuple[Callable[[bytes], object], bytes]] = [
    (t.decode_status, struct.pack("<HHHIB", 3000, 7, 0b1011, 0x21, 0)),
    (t.decode_channels, struct.pack("<4H", 1500, 1501, 1502, 1003)),
    (t.decode_raw_gps, struct.pack("<BBiihH", 1, 9, 453838000, -84733000, 131, 250)),
    (t.decode_attitude, struct.pack("<3h", 105, -32, -170)),
    (t.decode_altitude, struct.pack("<ih", -150, 30)),
    (t.decode_analog, struct.pack("<BHH", 124, 0, 920)),
]


@pytest.mark.parametrize(("decode", "payload"), LEAST)
def test_a_short_reply_is_unknown_and_a_long_reply_accepted(decode: Callable[[bytes], object], payload: bytes) -> None:
    assert decode(payload) is not None
    for size in range(len(payload)):
        assert decode(payload[:size]) is None
    for more in range(1, 60):
        assert decode(payload + bytes(more)) is not None


@given(st.binary(max_size=255))
def test_any_payload_is_read_or_unknown(payload: bytes) -> None:
    for decode, _ in LEAST:
        decode(payload)


def test_status_has_the_sensors() -> None:
    status = t.decode_status(LEAST[0][1])
    sensors = t.Sensor.ACCELEROMETER | t.Sensor.BAROMETER | t.Sensor.GPS
    assert status == t.StatusReport(3000, 7, sensors, 0x21)


@pytest.mark.parametrize(
    ("more", "course_ddeg", "hdop_e2"),
    [(b"", None, None), (struct.pack("<H", 2755), 2755, None), (struct.pack("<HH", 2755, 140), 2755, 140)],
)
def test_raw_gps_of_each_length_is_read(more: bytes, course_ddeg: int | None, hdop_e2: int | None) -> None:
    gps = t.decode_raw_gps(LEAST[2][1] + more)
    assert gps == t.RawGps(1, 9, 453838000, -84733000, 131, 250, course_ddeg, hdop_e2)


def test_an_altitude_below_sea_level_is_negative() -> None:
    """Harakiri stores a signed altitude in metres in an unsigned field."""
    gps = t.decode_raw_gps(struct.pack("<BBiiHH", 1, 9, 0, 0, 0xFFFF - 3, 0))
    assert gps is not None
    assert gps.altitude_m == -4


def test_the_current_is_read_if_present() -> None:
    assert t.decode_analog(struct.pack("<BHH", 124, 0, 920)) == t.Analog(12.4, 920)
    assert t.decode_analog(struct.pack("<BHHh", 124, 350, 920, 1234)) == t.Analog(12.4, 920, 350, 1234)
    assert t.decode_analog(struct.pack("<BHHhH", 255, 350, 920, -5, 3360)) == t.Analog(33.6, 920, 350, -5)


@pytest.mark.parametrize(("sent", "kept"), [(4, 4), (8, 8), (10, 10), (18, 18), (34, 18)])
def test_reads_at_most_the_channels_of_mavlink(sent: int, kept: int) -> None:
    assert t.decode_channels(struct.pack(f"<{sent}H", *range(1000, 1000 + sent))) == tuple(range(1000, 1000 + kept))


def test_names_from_the_line_are_printable() -> None:
    assert t.decode_box_names(b"ARM;AN\x1b[2JGLE;\x9b\n;") == ("ARM", "AN[2JGLE", "\ufffd ")
