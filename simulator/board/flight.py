# SPDX-License-Identifier: GPL-3.0-or-later
"""A plausible flight: sitting on a field while disarmed, circling slowly above it while armed."""

import math
from dataclasses import dataclass

#: The field of examples/naze-field.waypoints.
FIELD_LAT_E7 = 453838000
FIELD_LON_E7 = 84733000
#: Above the sea, metres.
FIELD_ALTITUDE_M = 131.0
_CRUISE_HEIGHT_M = 20.0
_CIRCLE_RADIUS_M = 25.0
_CRUISE_SPEED_MS = 2.5
_CLIMB_SECONDS = 8.0
METRES_PER_DEGREE = 111_320.0
METRES_PER_DEGREE_EAST = METRES_PER_DEGREE * math.cos(math.radians(FIELD_LAT_E7 / 1e7))
FULL_BATTERY_V = 12.6
EMPTY_BATTERY_V = 10.2
LEVEL_ACC = 0, 0, 512
_IDLE_SAG_VS = 0.0002
_FLIGHT_SAG_VS = 0.003


@dataclass(frozen=True, slots=True)
class FlightState:
    """Sensor values. Angles in degrees (`pitch`: nose down is positive), metres, metres a second, volts."""

    lat_e7: int
    lon_e7: int
    altitude_m: float
    height_m: float
    climb_ms: float
    speed_ms: float
    course: float
    roll: float
    pitch: float
    heading: float
    volts: float
    satellites: int = 9


@dataclass(frozen=True, slots=True)
class Craft:
    """The craft at one moment. `boxes`: the pilot's switches but ARM, one bit each. `home`: where it was armed.

    `acc`: the accelerometer, 512 for 1 g: forward, left, up.
    """

    flight: FlightState
    armed: bool
    boxes: int
    home: tuple[int, int] | None
    acc: tuple[int, int, int] = LEVEL_ACC

    def way_home(self) -> tuple[float, float]:
        """Distance in metres and direction in degrees, or zeros without a home."""
        if self.home is None:
            return 0.0, 0.0
        lat_e7, lon_e7 = self.home
        north = (lat_e7 - self.flight.lat_e7) / 1e7 * METRES_PER_DEGREE
        east = (lon_e7 - self.flight.lon_e7) / 1e7 * METRES_PER_DEGREE_EAST
        return math.hypot(north, east), math.degrees(math.atan2(east, north)) % 360


def fly(uptime: float, flown: float, armed: bool) -> FlightState:
    """The state `uptime` seconds after boot, after `flown` seconds armed."""
    # Metres north and east of the field's centre, on a circle that starts and ends there.
    angle = flown * _CRUISE_SPEED_MS / _CIRCLE_RADIUS_M
    north = _CIRCLE_RADIUS_M * math.sin(angle)
    east = _CIRCLE_RADIUS_M * (1 - math.cos(angle))
    course = math.degrees(angle) % 360
    climbed = 1 - math.exp(-flown / _CLIMB_SECONDS)
    height = _CRUISE_HEIGHT_M * climbed if armed else 0.0
    sway = 1.0 if armed else 0.1
    return FlightState(
        lat_e7=FIELD_LAT_E7 + round(north / METRES_PER_DEGREE * 1e7),
        lon_e7=FIELD_LON_E7 + round(east / METRES_PER_DEGREE_EAST * 1e7),
        altitude_m=FIELD_ALTITUDE_M + height,
        height_m=height,
        climb_ms=_CRUISE_HEIGHT_M / _CLIMB_SECONDS * (1 - climbed) if armed else 0.0,
        speed_ms=_CRUISE_SPEED_MS if armed else 0.0,
        course=course,
        roll=sway * (4.0 + 2.0 * math.sin(uptime * 0.9)),
        pitch=sway * (3.0 + 1.5 * math.sin(uptime * 0.7)),
        heading=course,
        volts=max(FULL_BATTERY_V - _IDLE_SAG_VS * uptime - _FLIGHT_SAG_VS * flown, EMPTY_BATTERY_V),
    )
