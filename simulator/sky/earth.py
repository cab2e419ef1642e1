# SPDX-License-Identifier: GPL-3.0-or-later
"""The place of a flight: latitude and longitude, air pressure, and the magnetic field."""

from dataclasses import dataclass
from math import cos, radians, sin

from simulator.sky.vectors import Vector

#: Metres for a degree of latitude, as the firmware assumes (1.113195 cm for 1e-7 degrees).
_METRES_PER_DEGREE = 111_319.5


@dataclass(frozen=True, slots=True)
class Place:
    """The launch place.

    Its magnetic field, in gauss, is about southern Germany's. The declination is the firmware's default of mag_dec.
    """

    lat: float = 48.1372
    lon: float = 11.5756
    alt_m: float = 500.0
    horizontal_gauss: float = 0.21
    down_gauss: float = 0.43
    declination_deg: float = 1 + 13 / 60

    def coordinates(self, position: Vector) -> tuple[float, float]:
        """Latitude and longitude of a place in world axes, degrees."""
        north, west, _ = position
        return self.lat + north / _METRES_PER_DEGREE, self.lon - west / (_METRES_PER_DEGREE * cos(radians(self.lat)))

    def position(self, lat: float, lon: float) -> tuple[float, float]:
        """Metres north and west of the launch place."""
        north = (lat - self.lat) * _METRES_PER_DEGREE
        return north, -(lon - self.lon) * _METRES_PER_DEGREE * cos(radians(self.lat))

    def pressure(self, height_m: float) -> float:
        """Pa, by the standard atmosphere (ICAO), at a height above the launch place."""
        return float(101_325.0 * (1 - 2.25577e-5 * (self.alt_m + height_m)) ** 5.25588)

    def field(self, compass_error_deg: float = 0.0) -> Vector:
        """Gauss, world axes. A compass in it points this much too far clockwise."""
        angle = radians(self.declination_deg - compass_error_deg)
        return self.horizontal_gauss * cos(angle), -self.horizontal_gauss * sin(angle), -self.down_gauss
