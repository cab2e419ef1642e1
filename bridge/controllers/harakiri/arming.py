# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's conditions for arming, as far as they can be seen: it reports none (mw.c, ArmIFpossible)."""

from bridge.model.flight_mode import FlightMode
from bridge.model.vehicle import Health, Mode, Sticks, Vehicle
from protocols.msp.telemetry import Sensor

_THROTTLE = 2
#: The highest value of rc_minchk, below which the throttle must be; its default is 1100.
_SURELY_NOT_LOW_US = 1250


def arming_blockers(vehicle: Vehicle, now: float) -> tuple[str, ...]:
    """The reasons that surely prevent arming.

    An accelerometer that is not calibrated, a scheduled write and the failsafe's delay prevent it, too, unseen.
    """
    sticks, mode, health = vehicle.fresh(Sticks, now), vehicle.fresh(Mode, now), vehicle.last(Health)
    throttle_us = () if sticks is None else sticks.channels_us[_THROTTLE : _THROTTLE + 1]
    has_baro = health is not None and Sensor.BAROMETER in health.sensors
    conditions = {
        "throttle not low": throttle_us and throttle_us[0] >= _SURELY_NOT_LOW_US,
        "switch BARO off": has_baro and mode is not None and mode.mode is FlightMode.ALT_HOLD,
    }
    return tuple(blocker for blocker, holds in conditions.items() if holds)
