# SPDX-License-Identifier: GPL-3.0-or-later
"""A craft that flies straight lines at constant speed, steered by the navigation of a simulated board."""

import math

from simulator.board.flight import (
    EMPTY_BATTERY_V,
    FIELD_ALTITUDE_M,
    FIELD_LAT_E7,
    FIELD_LON_E7,
    FULL_BATTERY_V,
    METRES_PER_DEGREE,
    METRES_PER_DEGREE_EAST,
    FlightState,
)

_CLIMB_MS = 2.0
_FLIGHT_SAG_VS = 0.002
_BANK_DEG, _NOSE_DOWN_DEG = 2.0, 8.0


class WaypointCraft:
    """Starts on its field. Metres, seconds, degrees. Positions are degrees * 1e7."""

    def __init__(self) -> None:
        self._north = self._east = 0.0
        self.height_m = 0.0
        self.heading = 0.0
        self._speed = self._climb = 0.0
        self._flown = 0.0

    @property
    def position(self) -> tuple[int, int]:
        """Latitude and longitude."""
        lat = FIELD_LAT_E7 + round(self._north / METRES_PER_DEGREE * 1e7)
        return lat, FIELD_LON_E7 + round(self._east / METRES_PER_DEGREE_EAST * 1e7)

    def rest(self) -> None:
        self.height_m = self._speed = self._climb = 0.0

    def hover(self, height_m: float, seconds: float) -> None:
        """Stay over this place and approach a height."""
        self._speed = 0.0
        self._flown += seconds
        self._approach_height(height_m, seconds)

    def fly_to(self, target: tuple[int, int], height_m: float, speed_ms: float, seconds: float) -> bool:
        """Fly towards a position; True once it is reached."""
        north = (target[0] - FIELD_LAT_E7) / 1e7 * METRES_PER_DEGREE - self._north
        east = (target[1] - FIELD_LON_E7) / 1e7 * METRES_PER_DEGREE_EAST - self._east
        distance = math.hypot(north, east)
        share = min(speed_ms * seconds / distance, 1.0) if distance else 1.0
        if distance:
            self.heading = math.degrees(math.atan2(east, north)) % 360
        self._north += north * share
        self._east += east * share
        self._speed = speed_ms
        self._flown += seconds
        self._approach_height(height_m, seconds)
        return share >= 1.0

    def state(self) -> FlightState:
        lat_e7, lon_e7 = self.position
        is_moving = self._speed > 0
        return FlightState(
            lat_e7=lat_e7,
            lon_e7=lon_e7,
            altitude_m=FIELD_ALTITUDE_M + self.height_m,
            height_m=self.height_m,
            climb_ms=self._climb,
            speed_ms=self._speed,
            course=self.heading,
            roll=_BANK_DEG if is_moving else 0.0,
            pitch=_NOSE_DOWN_DEG if is_moving else 0.0,
            heading=self.heading,
            volts=max(FULL_BATTERY_V - _FLIGHT_SAG_VS * self._flown, EMPTY_BATTERY_V),
        )

    def _approach_height(self, height_m: float, seconds: float) -> None:
        before = self.height_m
        change = _CLIMB_MS * seconds
        self.height_m = max(before - change, min(before + change, height_m))
        self._climb = (self.height_m - before) / seconds
