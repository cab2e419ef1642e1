# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances between places, and the course over ground for receivers that report a speed without a course."""

import math
from dataclasses import dataclass
from typing import Protocol

_METRES_PER_DEGREE = 111_320.0
#: Smaller moves are the receiver's noise.
_LEG_M = 1.0


class Place(Protocol):
    """Degrees * 1e7."""

    @property
    def lat_e7(self) -> int:
        """Latitude."""

    @property
    def lon_e7(self) -> int:
        """Longitude."""


@dataclass(slots=True)
class GroundTrack:
    """Follows successive positions."""

    _leg_began: Place | None = None
    _course_deg: float | None = None

    def course_deg(self, place: Place) -> float | None:
        """Add a position. The course, 0 up to 360, or None before the first metre."""
        if self._leg_began is None:
            self._leg_began = place
        elif distance_m(self._leg_began, place) >= _LEG_M:
            self._course_deg = bearing_deg(self._leg_began, place)
            self._leg_began = place
        return self._course_deg


def distance_m(start: Place, end: Place) -> float:
    """Metres between two places, by a flat-earth approximation."""
    return math.hypot(*north_east_m(start, end))


def passing_distance_m(start: Place, end: Place, place: Place) -> float:
    """Metres between a place and the straight line between two others."""
    north, east = north_east_m(start, end)
    place_north, place_east = north_east_m(start, place)
    length2 = north * north + east * east
    share = (north * place_north + east * place_east) / length2 if length2 else 0.0
    share = min(max(share, 0.0), 1.0)
    return math.hypot(place_north - share * north, place_east - share * east)


def bearing_deg(start: Place, end: Place) -> float:
    """Direction from one place to another, 0 up to 360."""
    north, east = north_east_m(start, end)
    return math.degrees(math.atan2(east, north)) % 360


def north_east_m(start: Place, end: Place) -> tuple[float, float]:
    metres_per_unit = _METRES_PER_DEGREE / 1e7
    # Take the short way across the date line.
    east_units = (end.lon_e7 - start.lon_e7 + 1_800_000_000) % 3_600_000_000 - 1_800_000_000
    north = (end.lat_e7 - start.lat_e7) * metres_per_unit
    return north, east_units * metres_per_unit * math.cos(math.radians(end.lat_e7 / 1e7))
