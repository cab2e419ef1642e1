# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own telemetry: short payloads are unknown, longer ones are accepted, and none raises."""

import struct
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.inav import (
    AIRSPEED_SIZE,
    ANALOG_SIZE,
    MIXER_SIZE,
    RTC_SIZE,
    decode_airspeed,
    decode_inav_analog,
    decode_inav_status,
    decode_platform,
    decode_rtc,
)

DECODERS = [
    (decode_inav_status, 21), (decode_inav_analog, ANALOG_SIZE), (decode_airspeed, AIRSPEED_SIZE),
    (decode_rtc, RTC_SIZE), (decode_platform, MIXER_SIZE),
]  # fmt: skip


@pytest.mark.parametrize(("decode", "size"), DECODERS)
@given(payload=st.binary(max_size=60))
def test_any_payload_is_read_or_unknown(decode: Callable[[bytes], object], size: int, payload: bytes) -> None:
    assert decode(payload[:2]) is None
    if len(payload) >= size:
        assert decode(payload) == decode(payload + b"\xff") is not None


def test_the_blockers_are_named() -> None:
    status = decode_inav_status(struct.pack("<HHHHBIQ", 1000, 2, 0xFFFF, 140, 0, 1 << 7 | 1 << 19, 1))
    assert status is not None
    assert (status.blockers, status.load_percent) == (("failsafe", "throttle not low"), 100)


def test_a_current_below_zero_stays_negative() -> None:
    analog = decode_inav_analog(struct.pack("<BHhiiiIBH", 0x40, 1630, -5, 0, -12, 0, 0, 87, 1023))
    assert analog is not None
    assert (analog.cells, analog.battery_cv, analog.current_ca, analog.drawn_mah) == (4, 1630, -5, -12)


def test_an_unset_inav_clock_is_zero() -> None:
    assert decode_rtc(bytes(6)) == 0
    assert decode_rtc(struct.pack("<IH", 1_790_000_000, 500)) == 1_790_000_000.5
