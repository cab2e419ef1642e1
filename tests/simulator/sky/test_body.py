# SPDX-License-Identifier: GPL-3.0-or-later
"""The rigid body: energy, momentum, rest, and the signs of its motors."""

from math import exp, isclose

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.sky.body import GRAVITY, Airframe, Body
from simulator.sky.vectors import ZERO, facing, heading_of, tilt_of, to_body, to_world

DT = 0.001
OFF = (1000,) * 4
#: Rear right, front right, rear left, front left.
HOVER_US = 1500
speeds = st.floats(-15, 15)
rates = st.floats(-6, 6)


def hover_pulse(frame: Airframe) -> float:
    low, high = 1000.0, 2000.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if frame.thrust(middle) * 4 < frame.mass * GRAVITY else (low, middle)
    return low


def airborne(frame: Airframe | None = None) -> Body:
    body = Body(frame)
    body.position = (0.0, 0.0, 1000.0)
    return body


def run(body: Body, seconds: float, pulses: tuple[int, ...] = OFF) -> Body:
    for _ in range(round(seconds / DT)):
        body.step(DT, pulses, ZERO)
    return body


@given(heading=st.floats(0, 360), seconds=st.floats(0.01, 0.5))
def test_a_craft_at_rest_stays_at_rest(heading: float, seconds: float) -> None:
    body = run(Body(heading_deg=heading), seconds)
    assert body.position == ZERO
    assert body.velocity == ZERO
    assert body.felt == pytest.approx((0, 0, GRAVITY), abs=1e-6)
    assert isclose((heading_of(body.attitude) - heading + 180) % 360, 180, abs_tol=1e-6)


@given(x=speeds, y=speeds, z=speeds)
def test_without_drag_and_motors_energy_is_kept(x: float, y: float, z: float) -> None:
    body = airborne(Airframe(drag=0.0))
    body.velocity = (x, y, z)

    def energy() -> float:
        return 0.5 * sum(part * part for part in body.velocity) + GRAVITY * body.position[2]

    before = energy()
    run(body, 0.2)
    # The semi-implicit step loses g^2 dt t / 2 at most.
    assert energy() == pytest.approx(before, abs=GRAVITY**2 * DT * 0.2)
    assert body.felt == pytest.approx(ZERO, abs=1e-9), "in free fall an accelerometer measures nothing"


@given(p=rates, q=rates, r=rates)
def test_without_drag_turning_energy_and_momentum_are_kept(p: float, q: float, r: float) -> None:
    body = airborne(Airframe(drag=0.0, turning_drag=0.0))
    body.rates = (p, q, r)
    inertia = body.frame.inertia

    def energy() -> float:
        return sum(i * w * w for i, w in zip(inertia, body.rates, strict=True))

    def momentum() -> tuple[float, float, float]:
        x, y, z = (i * w for i, w in zip(inertia, body.rates, strict=True))
        return to_world(body.attitude, (x, y, z))

    before, momentum_before = energy(), momentum()
    run(body, 0.2)
    assert energy() == pytest.approx(before, rel=0.01, abs=1e-9)
    assert momentum() == pytest.approx(momentum_before, rel=0.02, abs=2e-3)


@given(speed=st.floats(1, 15))
def test_drag_slows_it_as_the_time_constant_says(speed: float) -> None:
    body = airborne()
    body.velocity = (speed, 0.0, 0.0)
    run(body, 1.0)
    assert body.velocity[0] == pytest.approx(speed * exp(-body.frame.drag / body.frame.mass), rel=0.01)


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_it_hovers_near_half_throttle_regardless_of_the_weight(factor: float) -> None:
    pulse = hover_pulse(Airframe().scaled(factor))
    assert 1450 < pulse < 1550


@pytest.mark.parametrize(
    ("stronger", "moved"),
    [((2, 3), "right"), ((0, 1), "left"), ((0, 2), "forward"), ((1, 3), "backward")],
)
def test_stronger_motors_push_it_to_the_other_side(stronger: tuple[int, int], moved: str) -> None:
    body = airborne()
    pulses = tuple(1520 if index in stronger else 1480 for index in range(4))
    run(body, 0.15, pulses)
    run(body, 0.3, (HOVER_US,) * 4)
    x, y, _ = body.velocity
    assert {"right": y < -0.05, "left": y > 0.05, "forward": x > 0.05, "backward": x < -0.05}[moved]


def test_propellers_turn_it_the_other_way() -> None:
    """Rear right and front left turn clockwise, so the nose turns left."""
    body = run(airborne(), 1.0, (1600, 1400, 1400, 1600))
    assert 180 < heading_of(body.attitude) < 360


def test_on_the_ground_it_levels_without_a_jump() -> None:
    body = Body()
    body.attitude = (0.966, 0.259, 0.0, 0.0)
    run(body, 1.0)
    assert to_body(body.attitude, (0.0, 0.0, 1.0))[2] == pytest.approx(1.0, abs=1e-4)


@given(heading=st.floats(0, 359.9), x=speeds, y=speeds, z=speeds)
def test_rotating_there_and_back(heading: float, x: float, y: float, z: float) -> None:
    q = facing(heading)
    assert to_body(q, to_world(q, (x, y, z))) == pytest.approx((x, y, z), abs=1e-9)
    assert heading_of(q) == pytest.approx(heading, abs=1e-6) or heading_of(q) == pytest.approx(heading - 360, abs=1e-6)
    assert to_world(facing(90.0), (1.0, 0.0, 0.0)) == pytest.approx((0.0, -1.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(("height", "has_crashed"), [(0.1, False), (2.0, True)])
def test_it_falls_and_lands(height: float, has_crashed: bool) -> None:
    body = Body()
    body.position = (0.0, 0.0, height)
    run(body, 1.5)
    assert body.is_on_ground
    assert body.velocity == ZERO
    assert body.has_crashed is has_crashed
    assert body.touch_down_speed**2 == pytest.approx(2 * GRAVITY * height, rel=0.3)


def test_a_weak_motor_tilts_it() -> None:
    body = airborne()
    for _ in range(200):
        body.step(DT, (1700,) * 4, ZERO, weak=0.8)
    assert tilt_of(body.attitude) > 3.0
