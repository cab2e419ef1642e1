# SPDX-License-Identifier: GPL-3.0-or-later
"""The progress of a mission flight, as firmware/naze_flight.h numbers it."""

import re
import struct
from dataclasses import replace
from enum import IntEnum

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.mission_flight import (
    FLIGHT_REQUEST,
    FlightPhase,
    FlightProgress,
    FlightReason,
    decode_flight,
    decode_summary,
)
from simulator.naze.replies import encode_flight
from tests.support.programs import REPOSITORY

_HEADER = (REPOSITORY / "firmware" / "naze_flight.h").read_text()
REPLY = struct.pack("<6B3HIHhIh", 0, 2, 0b11111, 7, 18, 3, 4, 3, 9, 1250, 27000, -150, 61500, -2830)


def test_a_reply_is_read() -> None:
    progress = decode_flight(REPLY)
    assert progress is not None
    assert (progress.state, progress.reason) == (FlightPhase.LEG, FlightReason.STALLED)
    assert progress.is_enabled
    assert progress.switch_on
    assert progress.in_command
    assert progress.battery_low
    assert (progress.record, progress.reached) == (4, 3)
    assert (progress.distance, progress.bearing, progress.height_error, progress.state_s) == (12.5, 270, -1.5, 61.5)
    assert progress.compass == -28.3


def test_a_reply_is_written_as_it_was_read() -> None:
    progress = decode_flight(REPLY)
    assert progress is not None
    assert decode_flight(encode_flight(progress)) == progress
    assert decode_flight(encode_flight(replace(progress, record=None))) == replace(progress, record=None)


@pytest.mark.parametrize("record", [None, 0, 145])
def test_the_summary_has_state_reason_flags_and_record(record: int | None) -> None:
    told = FlightProgress(FlightPhase.HELD, FlightReason.STICKS, switch_on=True, battery_low=True, record=record)
    assert decode_summary(told.summary) == told
    assert decode_summary(0x00_00_00_12) is None, "a state that is unknown"


def test_an_empty_record_is_rejected() -> None:
    progress = decode_flight(REPLY[:6] + b"\xff\xff\xff\xff" + REPLY[10:])
    assert progress is not None
    assert progress.record is progress.reached is None


@pytest.mark.parametrize("at", [0, 1, 3, 4])
def test_another_status_version_state_or_reason_does_not_count_as_progress(at: int) -> None:
    assert decode_flight(REPLY[:at] + b"\x63" + REPLY[at + 1 :]) is None


@given(st.binary(max_size=40))
def test_any_bytes_are_read_or_refused(payload: bytes) -> None:
    progress = decode_flight(payload)
    assert progress is None or len(payload) >= len(REPLY)


def test_the_request_is_that_of_the_specification() -> None:
    assert bytes.fromhex("244d3c00b3b3") == FLIGHT_REQUEST


@pytest.mark.parametrize(
    ("values", "last", "others"), [(FlightPhase, "NF_STATES", {}), (FlightReason, "NF_REASONS", {"NONE": "OK"})]
)
def test_the_numbers_are_the_firmwares(values: type[IntEnum], last: str, others: dict[str, str]) -> None:
    block = next(body for body in re.findall(r"typedef enum \{(.*?)\}", _HEADER, re.DOTALL) if f"{last}\n" in body)
    names = re.findall(r"^    NF_(\w+)", block, re.MULTILINE)[:-1]
    assert names == [others.get(value.name, value.name) for value in values]
