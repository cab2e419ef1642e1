# SPDX-License-Identifier: GPL-3.0-or-later
"""Wind, noise, the place, the battery: their units and statistics."""

from math import hypot, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.sky.battery import Battery
from simulator.sky.earth import Place
from simulator.sky.wind import Wind


@given(speed=st.floats(0.5, 15), seed=st.integers(0, 100))
def test_wind_blows_from_the_given_direction(speed: float, seed: int) -> None:
    north, west, up = Wind(speed, 270.0, seed, gusts=False).at(0.0)
    assert (north, west, up) == pytest.approx((0.0, -speed, 0.0), abs=1e-9)


def test_gusts_average_to_zero() -> None:
    wind = Wind(5.0, 0.0, seed=3)
    found = [wind.at(0.05 * step) for step in range(40_000)]
    north = [v[0] for v in found]
    mean = sum(north) / len(north)
    assert mean == pytest.approx(-5.0, abs=0.15)
    assert sqrt(sum((v - mean) ** 2 for v in north) / len(north)) == pytest.approx(1.0, abs=0.15)


@given(north=st.floats(-2000, 2000), west=st.floats(-2000, 2000))
def test_coordinates_and_metres(north: float, west: float) -> None:
    place = Place()
    lat, lon = place.coordinates((north, west, 0.0))
    assert place.position(lat, lon) == pytest.approx((north, west), abs=1e-6)
    assert (lat - place.lat) * 111_320 == pytest.approx(north, rel=0.001, abs=1e-6)
    assert (lon - place.lon) * west <= 0


def test_pressure_falls_by_about_an_eighth_of_a_hectopascal_a_metre() -> None:
    place = Place(alt_m=0.0)
    assert place.pressure(0.0) == pytest.approx(101_325)
    assert place.pressure(0.0) - place.pressure(1.0) == pytest.approx(12.0, abs=0.1)


def test_the_field_points_north_and_down() -> None:
    north, west, up = Place().field()
    assert north > 0.2
    assert west < 0, "a positive declination is to the east"
    assert up < 0
    assert hypot(north, west) == pytest.approx(0.21)


def test_a_battery_empties_in_about_twenty_minutes() -> None:
    battery = Battery()
    assert battery.volts == pytest.approx(12.6, abs=0.1)
    for _ in range(1100):
        battery.step(1.0, 9.8)
    assert 10.0 < battery.volts < 10.8
