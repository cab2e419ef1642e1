# SPDX-License-Identifier: GPL-3.0-or-later
"""Vectors and rotations as tuples of floats."""

from math import atan2, cos, degrees, sin, sqrt

Vector = tuple[float, float, float]
#: w, x, y, z. Rotates body axes to world axes.
Quaternion = tuple[float, float, float, float]

ZERO: Vector = (0.0, 0.0, 0.0)


def to_world(q: Quaternion, v: Vector) -> Vector:
    """Rotate a vector from body to world axes."""
    w, x, y, z = q
    a, b, c = v
    # v + 2 u x (u x v + w v), with u the vector part.
    d, e, f = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c
    return a + 2 * (y * f - z * e), b + 2 * (z * d - x * f), c + 2 * (x * e - y * d)


def to_body(q: Quaternion, v: Vector) -> Vector:
    """Rotate a vector from world to body axes."""
    w, x, y, z = q
    return to_world((w, -x, -y, -z), v)


def turned(q: Quaternion, rates: Vector, dt: float) -> Quaternion:
    """The attitude after turning at constant body rates (rad/s)."""
    p, r, s = rates
    angle = sqrt(p * p + r * r + s * s) * dt
    half = 0.5 * dt * (1 - angle * angle / 24) if angle < 1e-3 else sin(angle / 2) / angle * dt
    a, b, c, d = cos(angle / 2), p * half, r * half, s * half
    w, x, y, z = q
    n = (
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )
    length = sqrt(sum(part * part for part in n))
    return n[0] / length, n[1] / length, n[2] / length, n[3] / length


def facing(heading_deg: float) -> Quaternion:
    """Level, with the nose at a heading (degrees clockwise from north)."""
    half = -heading_deg * 0.017453292519943295 / 2
    return cos(half), 0.0, 0.0, sin(half)


def heading_of(q: Quaternion) -> float:
    """The nose's heading, 0 to 360 degrees clockwise from north."""
    x, y, _ = to_world(q, (1.0, 0.0, 0.0))
    return degrees(atan2(-y, x)) % 360


def tilt_of(q: Quaternion) -> float:
    """The angle between the body's and the world's vertical, degrees."""
    x, y, z = to_world(q, (0.0, 0.0, 1.0))
    return degrees(atan2(sqrt(x * x + y * y), z))
