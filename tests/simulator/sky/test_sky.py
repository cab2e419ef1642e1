# SPDX-License-Identifier: GPL-3.0-or-later
"""What the sensors measure of a body at rest and in flight."""

from math import atan2, degrees
from statistics import fmean, stdev

import pytest

from simulator.sky.body import GRAVITY
from simulator.sky.sky import Sky, Weather
from simulator.sky.vectors import facing

OFF = (1000,) * 4


def still(seed: int = 0) -> Sky:
    sky = Sky(Weather(seed=seed), lambda: OFF)
    sky.advance(0.1)
    return sky


def test_at_rest_the_imu_measures_gravity_and_noise() -> None:
    sky = still()
    found = [sky.motion() for _ in range(2000)]
    assert fmean(motion.acceleration[2] for motion in found) == pytest.approx(GRAVITY, abs=0.01)
    assert fmean(motion.acceleration[0] for motion in found) == pytest.approx(0.0, abs=0.01)
    assert 0.0 < stdev(motion.rates[1] for motion in found) < 0.01


@pytest.mark.parametrize(("heading", "axis", "sign"), [(0.0, 0, 1), (90.0, 1, 1), (180.0, 0, -1), (270.0, 1, -1)])
def test_the_compass_follows_the_nose(heading: float, axis: int, sign: int) -> None:
    """With the nose to the east, north is left."""
    sky = still()
    sky.body.attitude = facing(heading)
    field = [fmean(values) for values in zip(*(sky.magnetic_field() for _ in range(200)), strict=True)]
    assert sign * field[axis] == pytest.approx(0.21, abs=0.01)
    assert field[2] == pytest.approx(-0.43, abs=0.01)


def test_a_lying_compass_points_too_far_clockwise_and_follows_the_motors() -> None:
    sky = still()
    sky.lies.compass = 30.0
    forward, left, _ = (fmean(values) for values in zip(*(sky.magnetic_field() for _ in range(200)), strict=True))
    # A compass reads the angle from its north to the nose, clockwise: 30 degrees less the declination.
    assert degrees(atan2(left, forward)) == pytest.approx(30 - sky.place.declination_deg, abs=1)
    sky.lies.motor_field = 0.1
    sky.body.thrusts = [GRAVITY / 4] * 4
    assert fmean(sky.magnetic_field()[1] for _ in range(200)) == pytest.approx(left + 0.1, abs=0.01)


def test_a_drifting_barometer_rises_on_the_ground() -> None:
    sky = still()
    before = fmean(sky.pressure() for _ in range(300))
    sky.lies.baro_drift = 1.0
    sky.advance(10.1)
    assert before - fmean(sky.pressure() for _ in range(300)) == pytest.approx(113, abs=5)


def test_propellers_press_the_air_on_the_ground() -> None:
    sky = still()
    before = fmean(sky.pressure() for _ in range(200))
    sky.lies.prop_wash = 1.0
    sky.body.thrusts = [GRAVITY / 4] * 4
    # 12 Pa are a metre.
    assert fmean(sky.pressure() for _ in range(200)) == pytest.approx(before + 12, abs=2)
    sky.body.position = (0.0, 0.0, 4.0)
    assert fmean(sky.pressure() for _ in range(200)) == pytest.approx(before - 48, abs=3)


def test_a_seed_repeats_a_flight() -> None:
    def fly(seed: int) -> tuple[float, ...]:
        sky = Sky(Weather(wind=5.0, seed=seed), lambda: (1550, 1551, 1549, 1550))
        sky.advance(3.0)
        return (*sky.body.position, sky.motion().acceleration[0])

    assert fly(4) == fly(4) != fly(5)


def test_a_craft_in_the_hand_turns_about_all_axes() -> None:
    sky = still()
    sky.is_held = True
    felt = []
    for step in range(600):
        sky.advance(0.2 + step * 0.1)
        felt.append(sky.body.felt)
    for axis in range(3):
        assert min(v[axis] for v in felt) < -0.8 * GRAVITY
        assert max(v[axis] for v in felt) > 0.8 * GRAVITY
