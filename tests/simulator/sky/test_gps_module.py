# SPDX-License-Identifier: GPL-3.0-or-later
"""The GPS module: its two languages, its lag, its noise, and what breaks it."""

import struct
from functools import reduce
from operator import xor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.sky.earth import Place
from simulator.sky.gps_module import GpsModule
from simulator.sky.lies import Lies
from simulator.sky.vectors import ZERO, Vector

BAUD = 115_200
TO_115200 = b"$PUBX,41,1,0003,0001,115200,0*1E\r\n"
RATE_5_HZ = b"\xb5\x62\x06\x08\x06\x00\xc8\x00\x01\x00\x01\x00\xde\x6a"


def run(gps: GpsModule, seconds: float, position: Vector = ZERO, velocity: Vector = ZERO, begin: float = 0.0) -> bytes:
    sent = b""
    for step in range(round(seconds * 50)):
        now = begin + step * 0.02
        gps.advance(now, position, velocity)
        sent += gps.take(now, BAUD)
    return sent


def ubx() -> GpsModule:
    gps = GpsModule(Place())
    gps.hear(RATE_5_HZ, BAUD)
    return gps


def frames(sent: bytes) -> list[tuple[int, bytes]]:
    """Message numbers and payloads; the checksums are right."""
    found = []
    while sent:
        assert sent[:3] == b"\xb5\x62\x01"
        (length,) = struct.unpack_from("<H", sent, 4)
        body, sent = sent[2 : 8 + length], sent[8 + length :]
        a = b = 0
        for byte in body[:-2]:
            a = (a + byte) % 256
            b = (b + a) % 256
        assert body[-2:] == bytes((a, b))
        found.append((body[1], body[4:-2]))
    return found


def test_it_speaks_nmea_until_it_is_configured() -> None:
    gps = GpsModule(Place())
    for line in run(gps, 1.0).split(b"\r\n")[:-1]:
        assert line.startswith((b"$GPGGA,", b"$GPRMC,"))
        body, checksum = line[1:].split(b"*")
        assert reduce(xor, body) == int(checksum, 16)
    gps.hear(RATE_5_HZ, BAUD)
    assert {kind for kind, _ in frames(run(gps, 1.0, begin=1.0))} == {0x02, 0x03, 0x06, 0x12}


def test_it_obeys_only_the_first_change_of_speed() -> None:
    gps = GpsModule(Place())
    gps.hear(TO_115200, 9600)
    gps.advance(0.0, ZERO, ZERO)
    assert gps.take(0.3, 9600) == b""
    gps.advance(0.2, ZERO, ZERO)
    assert gps.take(0.5, BAUD).startswith(b"$GPGGA")
    gps.hear(RATE_5_HZ, 9600)
    gps.advance(0.4, ZERO, ZERO)
    assert gps.take(0.7, BAUD).startswith(b"$GPGGA"), "at the wrong speed it hears nothing"


@given(chunks=st.lists(st.binary(max_size=40), max_size=20))
def test_arbitrary_bytes_are_harmless(chunks: list[bytes]) -> None:
    gps = GpsModule(Place())
    for chunk in chunks:
        gps.hear(chunk, BAUD)
    run(gps, 0.5)


def test_five_fixes_a_second_each_a_fifth_of_a_second_old() -> None:
    gps = ubx()
    fixes = [payload for kind, payload in frames(run(gps, 10.0)) if kind == 0x02]
    assert len(fixes) == 49
    assert gps.next_s == pytest.approx(10.0, abs=0.21)
    gps.take(19.0, BAUD)
    gps.advance(20.0, ZERO, ZERO)
    assert gps.take(20.1, BAUD) == b""
    assert gps.take(20.21, BAUD) != b""


def test_position_and_speed_have_the_protocols_units() -> None:
    place = Place()
    sent = frames(run(ubx(), 1.0, (100.0, 50.0, 20.0), (3.0, -4.0, 1.0)))
    position = next(payload for kind, payload in sent if kind == 0x02)
    _, lon, lat, _, alt, _, _ = struct.unpack("<IiiiiII", position)
    assert place.position(lat / 1e7, lon / 1e7) == pytest.approx((100.0, 50.0), abs=4.0)
    assert alt / 1000 == pytest.approx(place.alt_m + 20.0, abs=4.0)
    velocity = next(payload for kind, payload in sent if kind == 0x12)
    _, north, east, down, _, speed, course, _, _ = struct.unpack("<IiiiIIiII", velocity)
    assert (north, east, down, speed) == pytest.approx((300, 400, -100, 500), abs=25)
    assert course / 1e5 == pytest.approx(53.1, abs=4)


def test_a_hidden_sky_is_not_a_fix_and_a_broken_wire_is_silence() -> None:
    gps = ubx()
    gps.has_fix = False
    solution = next(payload for kind, payload in frames(run(gps, 1.0)) if kind == 0x06)
    assert solution[10] == 0
    assert solution[47] == 3
    gps.is_silent = True
    assert run(gps, 1.0, begin=1.0) == b""


def test_a_lying_module_jumps_drifts_and_reports_the_drift_as_speed() -> None:
    lies = Lies(gps_jump=20.0, gps_drift=0.5)
    gps = GpsModule(Place(), lies=lies)
    gps.hear(RATE_5_HZ, BAUD)
    sent = frames(run(gps, 20.0))
    north = [struct.unpack_from("<i", payload, 8)[0] / 1e7 - Place().lat for kind, payload in sent if kind == 0x02]
    speed = [struct.unpack_from("<i", payload, 4)[0] / 100 for kind, payload in sent if kind == 0x12]
    assert north[0] * 111_319.5 == pytest.approx(20, abs=3)
    assert (north[-1] - north[0]) * 111_319.5 == pytest.approx(10, abs=3)
    assert sum(speed) / len(speed) == pytest.approx(0.5, abs=0.05)
