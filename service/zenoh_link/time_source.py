# SPDX-License-Identifier: GPL-3.0-or-later
"""The time of samples, and its source, so that a reader can judge it."""

import time
from collections.abc import Callable
from pathlib import Path

from bridge.model.vehicle import Fix, GpsFix, GpsTime, Vehicle
from service.machine.raspberry_pi import SYNCHRONIZED

#: Autopilots send SYSTEM_TIME once a second or more often.
_FRESH_S = 5.0
#: A smaller difference to the Pi's clock is the time on the line.
_TOLERANCE_S = 0.5


class SampleClock:
    """The Pi's clock, corrected while it is wrong and the flight controller has the time from the GPS.

    `now`: the monotonic time of readings, s.
    """

    def __init__(self, now: Callable[[], float], synchronized: Path = Path(SYNCHRONIZED)) -> None:
        self._now = now
        self._synchronized = synchronized
        #: By GPS: when the monotonic clock was 0, seconds since 1970. None while the Pi's clock is right.
        self._epoch_s: float | None = None

    def unix_s(self) -> float:
        """Seconds since 1970 (UTC), in milliseconds: a Pi's clock is not a better, and each digit costs data."""
        return round(time.time() if self._epoch_s is None else self._epoch_s + self._now(), 3)

    def source(self, vehicle: Vehicle) -> str:
        """Find out the source: gps (the flight controller has a fix and the time), ntp or pi. `unix_s` then uses it."""
        gps_time, fix, now = vehicle.last(GpsTime), vehicle.last(GpsFix), self._now()
        if gps_time is not None and fix is not None and fix.fix is Fix.THREE_D:
            age_s = now - min(gps_time.heard_at, fix.heard_at)
            if age_s < _FRESH_S:
                self._follow(gps_time.unix_s - gps_time.heard_at, time.time() - now)
                return "gps"
        if self._synchronized.exists():
            self._epoch_s = None
            return "ntp"
        return "pi"

    def _follow(self, epoch_s: float, own_epoch_s: float) -> None:
        if abs(epoch_s - own_epoch_s) < _TOLERANCE_S:
            self._epoch_s = None
        elif self._epoch_s is None or abs(epoch_s - self._epoch_s) > _TOLERANCE_S:
            self._epoch_s = epoch_s
