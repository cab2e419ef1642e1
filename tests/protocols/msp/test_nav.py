# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests with a record: the bytes of the specification, and records that must never be sent."""

import pytest

from protocols.msp.nav import NavRecord, UnsafeRecord, decode_wp, encode_fly_to, encode_set_wp
from tests.support.nav_lists import A


@pytest.mark.parametrize("number", [0, 255, -1])
def test_home_and_the_hold_position_cannot_be_written(number: int) -> None:
    with pytest.raises(UnsafeRecord):
        encode_set_wp(number, NavRecord(A.WAYPOINT, 1, 2, 3))


def test_set_wp_has_the_bytes_of_the_specification() -> None:
    spec = bytes.fromhex("244d3c15d101018768111ff99254ff88130000000000000000007e")
    number, record = decode_wp(spec[5:-1]) or (0, NavRecord(0))
    assert encode_set_wp(number, record) == spec


@pytest.mark.parametrize("target", [0, -1, -32768])
def test_a_jump_that_crashes_cannot_even_be_encoded(target: int) -> None:
    with pytest.raises(UnsafeRecord):
        encode_set_wp(2, NavRecord(A.JUMP, p1=target))


def test_the_waypoint_is_set_by_the_index() -> None:
    """INAV counts from 0."""
    assert encode_fly_to(4)[:9] == bytes.fromhex("24583c002122010003")
