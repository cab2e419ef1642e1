# SPDX-License-Identifier: GPL-3.0-or-later
"""A quadcopter as a rigid body with four lagging motors, linear drag and a ground it can stand on."""

from dataclasses import dataclass
from math import exp, hypot, sqrt

from simulator.sky.vectors import ZERO, Quaternion, Vector, facing, tilt_of, to_body, to_world, turned

GRAVITY = 9.80665
#: Without a pulse, or below this, a speed controller stops its motor.
_STOPPED_US, _FULL_US = 1000, 2000
# How quickly the body levels on the ground, 1/s.
_SETTLING = 10.0
_FRONT_RIGHT = 1
#: Beyond these a touch-down is a crash: m/s down and along the ground, degrees.
_CRASH_DOWN, _CRASH_ALONG, _CRASH_TILT_DEG = 2.5, 3.0, 35.0


@dataclass(frozen=True, slots=True)
class Airframe:
    """A quad X of about 450 mm, motor to motor. SI units; `inertia` about the body's axes."""

    mass: float = 1.0
    inertia: Vector = (0.011, 0.011, 0.021)
    #: The distance of each motor from the roll and the pitch axis.
    arm: float = 0.16
    #: One motor's thrust at full throttle, N. A quarter of the weight is reached near half throttle.
    full_thrust: float = 7.6
    #: The part of the thrust that grows linearly with the pulse. The rest grows with its square.
    linear: float = 0.3
    #: A propeller's reaction torque for each newton of thrust, m.
    torque: float = 0.016
    motor_lag_s: float = 0.04
    #: N for each m/s of airspeed, and N m for each rad/s.
    drag: float = 0.25
    turning_drag: float = 0.002

    def scaled(self, factor: float) -> "Airframe":
        """The same craft of another weight, with motors to match."""
        x, y, z = self.inertia
        return Airframe(
            mass=self.mass * factor,
            inertia=(x * factor, y * factor, z * factor),
            full_thrust=self.full_thrust * factor,
            drag=self.drag,
        )

    def thrust(self, pulse_us: float) -> float:
        """A motor's steady thrust, N."""
        x = min(max((pulse_us - _STOPPED_US) / (_FULL_US - _STOPPED_US), 0.0), 1.0)
        return self.full_thrust * x * (self.linear + (1 - self.linear) * x)


class Body:
    """Begins on the ground at the launch place. Attributes are in world axes unless they say otherwise."""

    def __init__(self, frame: Airframe | None = None, heading_deg: float = 0.0) -> None:
        self.frame = frame or Airframe()
        self.position: Vector = ZERO
        self.velocity: Vector = ZERO
        self.attitude: Quaternion = facing(heading_deg)
        #: rad/s, body axes.
        self.rates: Vector = ZERO
        #: The specific force that an accelerometer measures, m/s2, body axes.
        self.felt: Vector = (0.0, 0.0, GRAVITY)
        #: Each motor's thrust, N: rear right, front right, rear left, front left.
        self.thrusts = [0.0] * 4
        #: The downward speed of the last touch-down, m/s.
        self.touch_down_speed = 0.0
        #: It has touched the ground too fast or too much tilted.
        self.has_crashed = False

    @property
    def is_on_ground(self) -> bool:
        return self.position[2] <= 0.0

    def step(self, dt: float, pulses_us: tuple[int, ...], wind: Vector, weak: float = 1.0) -> None:
        """Advance by `dt` (about a millisecond) with these motor pulses and this wind (m/s).

        weak: a factor of the front right motor's thrust.
        """
        frame = self.frame
        follow = 1 - exp(-dt / frame.motor_lag_s)
        thrusts = self.thrusts
        for index, pulse in enumerate(pulses_us):
            thrusts[index] += (frame.thrust(pulse) * (weak if index == _FRONT_RIGHT else 1.0) - thrusts[index]) * follow
        rear_right, front_right, rear_left, front_left = thrusts
        q, (vx, vy, vz) = self.attitude, self.velocity
        ax, ay, az = to_world(q, (0.0, 0.0, sum(thrusts) / frame.mass))
        drag = frame.drag / frame.mass
        ax += drag * (wind[0] - vx)
        ay += drag * (wind[1] - vy)
        az += drag * (wind[2] - vz) - GRAVITY
        if self.is_on_ground and az <= 0.0:
            self._stand(dt)
            return
        self.rates = self._turn(
            dt,
            frame.arm * (rear_left + front_left - rear_right - front_right),
            frame.arm * (rear_right + rear_left - front_right - front_left),
            # A propeller that turns clockwise turns the body to the left.
            frame.torque * (rear_right + front_left - front_right - rear_left),
        )
        self.attitude = turned(q, self.rates, dt)
        self.felt = to_body(q, (ax, ay, az + GRAVITY))
        self.velocity = vx, vy, vz = vx + ax * dt, vy + ay * dt, vz + az * dt
        x, y, z = self.position
        self.position = x + vx * dt, y + vy * dt, z + vz * dt
        if self.position[2] <= 0.0 and vz < 0.0:
            self.touch_down_speed = -vz
            if -vz > _CRASH_DOWN or hypot(vx, vy) > _CRASH_ALONG or tilt_of(self.attitude) > _CRASH_TILT_DEG:
                self.has_crashed = True
            self.position = self.position[0], self.position[1], 0.0

    def _turn(self, dt: float, roll: float, pitch: float, yaw: float) -> Vector:
        """Euler's equations: the body rates after these torques (N m)."""
        (ix, iy, iz), (p, q, r), drag = self.frame.inertia, self.rates, self.frame.turning_drag
        return (
            p + dt * (roll - drag * p - (iz - iy) * q * r) / ix,
            q + dt * (pitch - drag * q - (ix - iz) * r * p) / iy,
            r + dt * (yaw - drag * r - (iy - ix) * p * q) / iz,
        )

    def _stand(self, dt: float) -> None:
        """On the ground it stays where it is, and levels on the legs."""
        self.velocity = ZERO
        self.position = self.position[0], self.position[1], 0.0
        up_x, up_y, up_z = to_body(self.attitude, (0.0, 0.0, 1.0))
        self.rates = (-_SETTLING * up_y, _SETTLING * up_x, 0.0)
        self.attitude = turned(self.attitude, self.rates, dt)
        self.felt = (GRAVITY * up_x, GRAVITY * up_y, GRAVITY * up_z)

    @property
    def speed(self) -> float:
        """Over the ground, m/s."""
        return sqrt(self.velocity[0] ** 2 + self.velocity[1] ** 2)
