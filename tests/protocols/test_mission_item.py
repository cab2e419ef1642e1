# SPDX-License-Identifier: GPL-3.0-or-later
"""Positions of mission items."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.mission_item import degrees_to_e7, is_on_earth


@given(e7=st.integers(-1_800_000_000, 1_800_000_000))
def test_degrees_of_whole_units_are_exact(e7: int) -> None:
    assert degrees_to_e7(e7 / 1e7) == e7


@pytest.mark.parametrize("degrees", [math.nan, math.inf, -math.inf, 1e308])
def test_a_number_that_is_not_finite_is_missing(degrees: float) -> None:
    assert degrees_to_e7(degrees) is None


def test_places_beyond_the_poles_and_the_date_line_are_refused() -> None:
    for sign in (-1, 1):
        assert is_on_earth(sign * 900_000_000, sign * 1_800_000_000)
        assert not is_on_earth(sign * (900_000_000 + 1), 0)
        assert not is_on_earth(0, sign * (1_800_000_000 + 1))
