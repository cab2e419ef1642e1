# SPDX-License-Identifier: GPL-3.0-or-later
"""Body, wind and battery in one time, and the sensors' measurements of them."""

import random
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from math import exp, pi, sin

from simulator.sky.battery import Battery
from simulator.sky.body import GRAVITY, Airframe, Body
from simulator.sky.earth import Place
from simulator.sky.lies import Lies
from simulator.sky.noise import Wander
from simulator.sky.vectors import Vector, to_body, turned
from simulator.sky.wind import Wind

_STEP_S = 0.001
#: The MPU-6050's low-pass filter at DLPF_CFG 3: 44 Hz.
_FILTER = 1 - 1 / (1 + 2 * pi * 44.0 * _STEP_S)
#: Standard deviations of one measurement: m/s2, rad/s, gauss, Pa.
_ACCELERATION_NOISE, _RATE_NOISE, _FIELD_NOISE, _PRESSURE_NOISE = 0.08, 0.002, 0.002, 1.2
#: The amplitude of the propellers' vibration in a hover that passes the filter, m/s2, and its frequency as sampled.
_VIBRATION, _VIBRATION_HZ = 0.4, 83.0
#: The propellers' pressure on the barometer falls with the height, m.
_WASH_HEIGHT = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """`wind` m/s from `wind_from` degrees; `seed` of all noise."""

    wind: float = 0.0
    wind_from: float = 270.0
    gusts: bool = True
    seed: int = 0


@dataclass(slots=True)
class Motion:
    """The IMU's measurements: m/s2 and rad/s in body axes."""

    acceleration: Vector = (0.0, 0.0, GRAVITY)
    rates: Vector = field(default=(0.0, 0.0, 0.0))


class Sky:
    """`pulses` returns the motors' pulse lengths, in the firmware's order."""

    def __init__(
        self,
        weather: Weather,
        pulses: Callable[[], tuple[int, ...]],
        frame: Airframe | None = None,
        heading: float = 0.0,
        place: Place | None = None,
        lies: Lies | None = None,
    ) -> None:
        self.lies = lies or Lies()
        self.body = Body(frame, heading)
        self.wind = Wind(weather.wind, weather.wind_from, weather.seed, gusts=weather.gusts)
        self.place = place or Place()
        self.battery = Battery()
        #: Set to turn the craft about slowly in a pilot's hands, to calibrate the compass.
        self.is_held = False
        self.now_s = 0.0
        self._pulses = pulses
        self._noise = random.Random(f"sensors {weather.seed}")
        self._pressure_drift = Wander(self._noise, 0.6, 120.0)
        self._motion = Motion()
        self._baro_error = 0.0

    def set_out(self, weather: Weather, frame: Airframe, lies: Lies) -> None:
        """Put another craft at the launch place, in other weather, while the board keeps running."""
        self.body = Body(frame)
        self.wind = Wind(weather.wind, weather.wind_from, weather.seed, gusts=weather.gusts)
        for name in fields(Lies):
            setattr(self.lies, name.name, getattr(lies, name.name))
        self._baro_error = 0.0

    def advance(self, now_s: float) -> None:
        """Let time pass."""
        if now_s < self.now_s + _STEP_S:
            return
        pulses, body, motion, weak = self._pulses(), self.body, self._motion, self.lies.weak_motor
        begun_s = self.now_s
        while self.now_s + _STEP_S <= now_s:
            self.now_s += _STEP_S
            if self.is_held:
                self._hold()
            else:
                body.step(_STEP_S, pulses, self.wind.at(self.now_s), weak)
            a, b = motion.acceleration, body.felt
            motion.acceleration = (
                a[0] + _FILTER * (b[0] - a[0]),
                a[1] + _FILTER * (b[1] - a[1]),
                a[2] + _FILTER * (b[2] - a[2]),
            )
            a, b = motion.rates, body.rates
            motion.rates = (
                a[0] + _FILTER * (b[0] - a[0]),
                a[1] + _FILTER * (b[1] - a[1]),
                a[2] + _FILTER * (b[2] - a[2]),
            )
        self._baro_error += self.lies.baro_drift * (self.now_s - begun_s)
        self.battery.step(self.now_s - begun_s, sum(body.thrusts))

    def _hold(self) -> None:
        """Turn about all axes, so that every part of the sphere points north once."""
        t, body = self.now_s, self.body
        body.rates = (1.1 * sin(0.23 * t), 1.3 * sin(0.31 * t + 1), 0.8 * sin(0.17 * t + 2))
        body.attitude = turned(body.attitude, body.rates, _STEP_S)
        body.felt = to_body(body.attitude, (0.0, 0.0, GRAVITY))

    # -- the sensors -----------------------------------------------------------------------------------------

    def motion(self) -> Motion:
        """A measurement of the IMU, with noise and vibration."""
        gauss = self._noise.gauss
        shake = self.lies.vibration * _VIBRATION * min(self._hovers, 2.0)
        phase = 2 * pi * _VIBRATION_HZ * self.now_s
        shakes = shake * sin(phase), shake * sin(phase + 2.0), shake * sin(phase + 4.0)
        a, r = self._motion.acceleration, self._motion.rates
        return Motion(
            (
                a[0] + shakes[0] + gauss(0, _ACCELERATION_NOISE),
                a[1] + shakes[1] + gauss(0, _ACCELERATION_NOISE),
                a[2] + shakes[2] + gauss(0, _ACCELERATION_NOISE),
            ),
            (r[0] + gauss(0, _RATE_NOISE), r[1] + gauss(0, _RATE_NOISE), r[2] + gauss(0, _RATE_NOISE)),
        )

    @property
    def _hovers(self) -> float:
        """The thrust as a part of the weight."""
        return sum(self.body.thrusts) / (GRAVITY * self.body.frame.mass)

    def magnetic_field(self) -> Vector:
        """Gauss, body axes."""
        x, y, z = to_body(self.body.attitude, self.place.field(self.lies.compass))
        y += self.lies.motor_field * self._hovers
        gauss = self._noise.gauss
        return x + gauss(0, _FIELD_NOISE), y + gauss(0, _FIELD_NOISE), z + gauss(0, _FIELD_NOISE)

    def pressure(self) -> float:
        """Pa."""
        drift = self._pressure_drift.step(0.01)
        height = self.body.position[2]
        wash = self.lies.prop_wash * self._hovers * exp(-height / _WASH_HEIGHT)
        return self.place.pressure(height - wash + self._baro_error) + drift + self._noise.gauss(0, _PRESSURE_NOISE)
