# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated INAV's settings: sizes and special cases of each version, as observed on INAV's own simulators."""

import pytest

from protocols.msp.inav_settings import COMMON_SET_SETTING, COMMON_SETTING, COMMON_SETTING_INFO, decode_setting_info
from simulator.board.msp_options import MspOptions
from tests.support.msp_bench import MspBench


def set_text(bench: MspBench, name: str, text: bytes) -> bytes:
    """Set it; returns its place."""
    assert bench.payload_v2(COMMON_SET_SETTING, name.encode() + b"\0" + text) == b""
    return bench.payload_v2(COMMON_SETTING, name.encode() + b"\0")


def test_a_text_fills_the_place_and_the_bytes_behind_the_end_stay() -> None:
    bench = MspBench("inav")
    assert set_text(bench, "pilot_name", b"Ann") == b"Ann".ljust(16, b"\0")
    assert set_text(bench, "pilot_name", b"x" * 17) == b"x" * 16
    assert set_text(bench, "pilot_name", b"") == b"\0" + b"x" * 15


def test_the_crafts_name_is_a_setting() -> None:
    bench = MspBench("inav")
    assert set_text(bench, "name", b"Kite\0 2") == b"Kite\0 2".ljust(16, b"\0")
    assert bench.payload(10) == b"Kite"
    assert bench.payload(11, b"") == bench.payload(10) == b""


@pytest.mark.parametrize(("version", "section"), [("6.1.1", 0x10), ("7.1.2", 0x08), ("9.0.1", 0x08)])
def test_gains_are_16_bit_values_of_three_profiles(version: str, section: int) -> None:
    bench = MspBench("inav", MspOptions(version=version))
    reply = bench.payload_v2(COMMON_SETTING_INFO, b"mc_p_pitch\0")
    assert reply.endswith(b"\0\x03\x28\0")
    found = decode_setting_info(reply)
    assert found is not None
    assert (found.section, found.maximum) == (section, 255)
