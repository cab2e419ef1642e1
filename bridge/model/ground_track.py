# SPDX-License-Identifier: GPL-3.0-or-later
"""Velocity over ground, for flight controllers that send a speed but no course: its direction is that of two fixes."""

import math

from protocols.msp.telemetry import RawGps

_METRES_PER_DEGREE = 111_320.0
#: Fixes nearer to each other than this say more of the receiver's noise than of the way.
_LEG_M = 1.0

#: Metres a second to the north and to the east.
Velocity = tuple[float, float]


class GroundTrack:
    """Follows the fixes of one receiver. Its speed is measured, and taken as it is; only the direction is made."""

    def __init__(self) -> None:
        self._leg_began: RawGps | None = None
        self._direction: tuple[float, float] | None = None

    def velocity(self, gps: RawGps) -> Velocity | None:
        """Take a fix; None while it moves and nothing tells where to: at the first one."""
        speed = gps.speed_cms / 100
        if gps.course_ddeg is not None:
            course = math.radians(gps.course_ddeg / 10)
            return speed * math.cos(course), speed * math.sin(course)
        self._leg_began = self._leg_began or gps
        north, east = _way(self._leg_began, gps)
        metres = math.hypot(north, east)
        direction = self._direction or ((north / metres, east / metres) if metres else None)
        if metres >= _LEG_M:
            self._leg_began = gps
            self._direction = direction = north / metres, east / metres
        if direction is None:
            return None if speed else (0.0, 0.0)
        return speed * direction[0], speed * direction[1]


def _way(start: RawGps, end: RawGps) -> tuple[float, float]:
    """Return metres to the north and to the east."""
    metres_per_unit = _METRES_PER_DEGREE / 1e7
    # Across the date line the short way is meant.
    east_units = (end.lon_e7 - start.lon_e7 + 1_800_000_000) % 3_600_000_000 - 1_800_000_000
    north = (end.lat_e7 - start.lat_e7) * metres_per_unit
    return north, east_units * metres_per_unit * math.cos(math.radians(end.lat_e7 / 1e7))
