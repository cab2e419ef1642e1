# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances and courses between places, also across the date line."""

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.model.ground_track import GroundTrack, bearing_deg, distance_m, passing_distance_m

METRE = 90
LAT, LON = 453838000, 84733000


@dataclass(frozen=True)
class Place:
    lat_e7: int = LAT
    lon_e7: int = LON


PLACES = st.builds(Place, st.integers(-800000000, 800000000), st.integers(-1800000000, 1800000000))


@pytest.mark.parametrize(
    ("end", "degrees"),
    [(Place(LAT + 9000), 0), (Place(LAT, LON + 9000), 90), (Place(LAT - 9000), 180), (Place(LAT, LON - 9000), 270)],
)
def test_the_course_is_that_of_the_last_leg(end: Place, degrees: float) -> None:
    track = GroundTrack()
    assert track.course_deg(Place()) is None
    assert track.course_deg(Place(LAT + METRE // 3)) is None, "a receiver's noise is no course"
    assert track.course_deg(end) == pytest.approx(degrees, abs=0.01)
    assert track.course_deg(Place(end.lat_e7 + METRE // 3, end.lon_e7)) == pytest.approx(degrees, abs=0.01)


def test_the_date_line_is_crossed_the_short_way() -> None:
    west, east = Place(0, 1800000000 - 500), Place(0, -1800000000 + 500)
    assert distance_m(west, east) == pytest.approx(11.1, abs=0.1)
    assert bearing_deg(west, east) == pytest.approx(90)


@given(start=PLACES, end=PLACES, share=st.floats(0, 1))
def test_a_leg_contains_both_ends(start: Place, end: Place, share: float) -> None:
    assert passing_distance_m(start, end, start) == pytest.approx(0, abs=0.01)
    assert passing_distance_m(start, end, end) == pytest.approx(0, abs=0.01)
    assert 0 <= bearing_deg(start, end) < 360


def test_the_distance_to_a_leg_is_that_to_the_nearest_point() -> None:
    start, end = Place(), Place(LAT + 100 * METRE)
    beside = Place(LAT + 50 * METRE, LON + 2000)
    assert passing_distance_m(start, end, beside) == pytest.approx(distance_m(Place(beside.lat_e7), beside), rel=0.01)
    behind = Place(LAT + 200 * METRE)
    assert passing_distance_m(start, end, behind) == pytest.approx(distance_m(end, behind), rel=0.01)
