# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the board's magnetic declination with that of the craft's place, before take-off.

A wrong declination turns every flight to a place by the same angle: Harakiri's default is 26 degrees off in Cape Town.
"""

import math

from bridge.gcs.ground import Ground
from bridge.model.settings import SettingTable
from bridge.model.vehicle import GlobalPosition, Health, Vehicle
from bridge.voice.happening import Happening
from bridge.voice.sentences import DECLINATION
from protocols.msp.telemetry import Sensor

#: Degrees east, every 10 degrees of latitude from 50 south and 15 of longitude from 180 west, for mid 2027 from
#: the World Magnetic Model 2025 (NOAA, public domain). Interpolated, they are right within 2.5 degrees.
_SOUTH, _LATITUDES, _LONGITUDES = -50, 10, 15
# fmt: off
_DECLINATIONS = (
    (32, 32, 31, 30, 30, 28, 23, 14, 2, -7, -12, -15, -21, -31, -42, -52, -57, -58, -52, -37, -13, 10, 23, 30),
    (23, 24, 23, 23, 23, 22, 18, 8, -5, -15, -19, -20, -22, -29, -39, -45, -46, -41, -30, -15, -2, 7, 15, 21),
    (17, 18, 18, 17, 17, 16, 12, 2, -12, -21, -24, -23, -20, -21, -28, -32, -32, -25, -15, -5, 1, 6, 11, 15),
    (14, 14, 14, 13, 12, 12, 8, -3, -16, -23, -24, -21, -14, -10, -12, -17, -18, -13, -7, -1, 1, 4, 8, 12),
    (11, 11, 11, 11, 10, 9, 4, -6, -17, -22, -20, -15, -8, -3, -2, -7, -9, -7, -3, 0, 1, 3, 6, 10),
    (10, 10, 9, 9, 8, 7, 2, -8, -17, -20, -16, -9, -4, 0, 2, -1, -4, -3, -2, 0, 0, 1, 5, 8),
    (9, 9, 9, 9, 8, 6, 0, -9, -16, -17, -12, -6, -1, 2, 3, 1, -1, -1, -1, 0, -2, -1, 3, 7),
    (8, 9, 10, 10, 9, 6, -1, -10, -15, -15, -10, -4, 0, 3, 4, 3, 1, 0, -1, -2, -4, -4, 0, 5),
    (6, 9, 11, 12, 11, 7, -2, -11, -15, -13, -8, -3, 1, 3, 5, 4, 3, 2, 0, -3, -6, -7, -4, 1),
    (4, 9, 12, 14, 13, 7, -2, -12, -15, -13, -8, -3, 2, 4, 6, 6, 6, 4, 1, -4, -9, -10, -7, -2),
    (2, 8, 13, 16, 15, 8, -3, -14, -18, -15, -10, -4, 1, 5, 8, 10, 11, 9, 3, -5, -11, -13, -10, -4),
    (0, 8, 14, 18, 17, 9, -6, -18, -22, -19, -13, -6, 1, 7, 12, 16, 18, 15, 6, -6, -14, -16, -12, -6),
)
# fmt: on
#: Reported from this error on: degrees.
_REPORTED_DEG = 5.0
#: While it is on, INAV finds the declination itself.
_AUTOMATIC = "inav_auto_mag_decl"


def declination_deg(lat_deg: float, lon_deg: float) -> float | None:
    """East is positive. None near the poles, where it changes too fast for the table."""
    row, north = divmod((lat_deg - _SOUTH) / _LATITUDES, 1)
    column, east = divmod((lon_deg + 180) / _LONGITUDES, 1)
    if not 0 <= row < len(_DECLINATIONS) - 1:
        return None
    south_row, north_row = _DECLINATIONS[int(row)], _DECLINATIONS[int(row) + 1]
    here, there = int(column) % len(south_row), (int(column) + 1) % len(south_row)
    south_deg = south_row[here] + (south_row[there] - south_row[here]) * east
    north_deg = north_row[here] + (north_row[there] - north_row[here]) * east
    return south_deg + (north_deg - south_deg) * north


class CompassCheck:
    """Warns once, and each station that connects later, until the setting is right. wrong: the present warning."""

    def __init__(self, vehicle: Vehicle, ground: Ground) -> None:
        self._vehicle = vehicle
        self._ground = ground
        #: The settings that were compared last: the declination is the same wherever one battery takes the craft.
        self._compared: SettingTable | None = None
        self.wrong: Happening | None = None

    def follow(self, table: SettingTable) -> None:
        """Compare settings that have changed with the place just heard."""
        place, health = self._vehicle.last(GlobalPosition), self._vehicle.last(Health)
        if table is self._compared or place is None or health is None:
            return
        self._compared = table
        problem = _problem(table, place) if Sensor.COMPASS in health.sensors else None
        if problem == self.wrong:
            return
        notices = self._ground.notices
        if self.wrong in notices:
            notices.remove(self.wrong)
        self.wrong = problem
        if problem is not None:
            self._ground.say(problem)
            notices.append(problem)


def _problem(table: SettingTable, place: GlobalPosition) -> Happening | None:
    setting = table.find("mag_dec") or table.find("mag_declination")
    automatic = table.find(_AUTOMATIC)
    here_deg = declination_deg(place.lat_e7 / 1e7, place.lon_e7 / 1e7)
    if here_deg is None or setting is None or isinstance(setting.value, str) or (automatic and automatic.value):
        return None
    # 100 times the degrees, plus the minutes.
    minutes, degrees = math.modf(setting.value / 100)
    off_deg = abs(math.remainder(here_deg - degrees - minutes / 0.6, 360))
    return DECLINATION(round(off_deg), setting.name, 100 * round(here_deg)) if off_deg >= _REPORTED_DEG else None
