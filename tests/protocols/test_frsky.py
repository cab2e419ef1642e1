# SPDX-License-Identifier: GPL-3.0-or-later
"""FrSky telemetry: Harakiri's groups are decoded, damaged ones are dropped, and no bytes raise."""

import dataclasses
import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.frsky import FrskyParser, FrskyReport
from simulator.board.flight import FlightState, fly
from simulator.naze import frsky

#: The values 0x5E and 0x5D have to be escaped.
HEADING_94 = bytes.fromhex("5e 10 0c 00 5e 21 5d3d 00 5e 14 5d3e 00 5e 1c 00 00 5e")
#: 12.4 V in three cells of 4.1 V, 45 degrees 23.0287 minutes north, 8 degrees 28.4007 minutes east.
POWER = bytes.fromhex("5e 06 08 02 5e 3a 06 00 5e 3b 05 00")
PLACE = bytes.fromhex("5e 13 ab 11 5e 1b 1f 01 5e 23 4e 00 5e 12 3c 03 5e 1a a7 0f 5e 22 45 00")
TEMPERATURE = bytes.fromhex("5e 02 03 00")
NEXT = b"\x5e\x24"

FLIGHTS = st.builds(
    lambda state, **changed: dataclasses.replace(state, **changed),
    st.just(fly(0, 0, True)),
    lat_e7=st.integers(-899_999_999, 899_999_999),
    lon_e7=st.integers(-1_799_999_999, 1_799_999_999),
    height_m=st.floats(-100, 3000),
    heading=st.floats(0, 359.99),
    volts=st.floats(6.6, 24.0),
)


def read(data: bytes) -> list[FrskyReport]:
    return FrskyParser().feed(data)


def test_a_group_sent_by_harakiri_is_read() -> None:
    assert read(HEADING_94 + NEXT) == [FrskyReport(height_m=12.93, heading_deg=94)]
    (report,) = read(TEMPERATURE + POWER + PLACE + NEXT[:1] + NEXT)
    assert report == FrskyReport(voltage_v=12.4, place_e7=(453838117, 84733450))
    assert read(TEMPERATURE + PLACE + NEXT[:1] + NEXT) == [FrskyReport(place_e7=report.place_e7)]
    assert read(TEMPERATURE + NEXT[:1] + NEXT) == [FrskyReport()]


@given(FLIGHTS, st.integers(1, 80), st.lists(st.integers(0, 200), max_size=4))
def test_frames_from_the_simulator_are_read(flight: FlightState, number: int, cuts: list[int]) -> None:
    sent = frsky.frames(flight, number, 61.0) + NEXT
    borders = [0, *sorted(cuts), len(sent)]
    parser = FrskyParser()
    reports = [report for start, end in itertools.pairwise(borders) for report in parser.feed(sent[start:end])]
    assert len(reports) == (number % 4 == 0) + (number % 8 == 0)
    for report in reports:
        if report.heading_deg is not None:
            assert abs((report.heading_deg - flight.heading + 180) % 360 - 180) <= 1
            if flight.height_m < 0.01:
                assert report.height_m is None
            else:
                assert report.height_m == pytest.approx(flight.height_m, abs=0.0101)
        else:
            assert report.voltage_v == pytest.approx(flight.volts, abs=0.16)
            if abs(flight.lat_e7) > 17 and abs(flight.lon_e7) > 17:
                assert report.place_e7 is not None
                assert report.place_e7[0] == pytest.approx(flight.lat_e7, abs=17)
                assert report.place_e7[1] == pytest.approx(flight.lon_e7, abs=17)


@given(FLIGHTS, st.data())
def test_a_damaged_group_is_dropped_or_in_range(flight: FlightState, data: st.DataObject) -> None:
    sent = bytearray(frsky.frames(flight, 8, 61.0) + NEXT)
    for _ in range(data.draw(st.integers(1, 3))):
        sent[data.draw(st.integers(0, len(sent) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    for report in read(bytes(sent)):
        assert report.heading_deg is None or 0 <= report.heading_deg < 360
        if report.place_e7:
            assert abs(report.place_e7[0]) <= 900_000_000
            assert abs(report.place_e7[1]) <= 1_800_000_000


@pytest.mark.parametrize("at", range(len(TEMPERATURE + POWER + PLACE)))
def test_a_lost_byte_drops_the_whole_group(at: int) -> None:
    whole = TEMPERATURE + POWER + PLACE
    reports = read(whole[:at] + whole[at + 1 :] + NEXT[:1] + NEXT)
    assert [report for report in reports if report.voltage_v or report.place_e7] == []


@pytest.mark.parametrize(
    "damaged", [b"\x5e\x06\x08", b"\x5e\x06\x08\x02\x00", b"\x5e\x06\x08\x5d\x5e", b"\x5e\x77\x08\x02"]
)
def test_values_before_and_after_a_damaged_one_are_no_group(damaged: bytes) -> None:
    assert read(TEMPERATURE + damaged + PLACE + NEXT[:1] + NEXT) == []


@pytest.mark.parametrize("bit", range(16))
def test_volts_that_disagree_with_the_cells_are_unknown(bit: int) -> None:
    damaged = bytearray(POWER)
    damaged[6 + bit // 8] ^= 1 << bit % 8
    reports = read(TEMPERATURE + bytes(damaged) + NEXT[:1] + NEXT)
    assert [report.voltage_v for report in reports] in ([None], [])


@given(st.lists(st.one_of(st.binary(max_size=40), st.sampled_from([HEADING_94, TEMPERATURE, POWER, PLACE, NEXT]))))
def test_any_bytes_raise_nothing(chunks: list[bytes]) -> None:
    parser = FrskyParser()
    for chunk in chunks:
        parser.feed(chunk)
    assert parser.values_in_a_row >= 0
