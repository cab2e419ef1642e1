# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission items for the rule tests: a plain one of each kind, with changes given by the test."""

from typing import Any

from protocols.mission_item import MissionItem

LAT, LON = 453838000, 84733000
HERE = {"lat_e7": LAT, "lon_e7": LON}

WAYPOINT, UNLIM, TURNS, TIME, RTL, LAND, TAKEOFF = 16, 17, 18, 19, 20, 21, 22
ROI, ROI_LOCATION, ROI_NONE, SET_ROI = 80, 195, 197, 201
SPEED = 178  # DO_CHANGE_SPEED: unknown to Harakiri


def item(command: int, **changed: Any) -> MissionItem:
    """An item that the rules do not change (in a valid position of the list, with a radius of 2 m)."""
    at_a_place = command in (WAYPOINT, UNLIM, TURNS, TIME, ROI, ROI_LOCATION, SET_ROI)
    plain: dict[str, Any] = {
        "seq": 0,
        "command": command,
        "frame": 3,
        "p1": 1.0 if command in (TURNS, TIME) else 0.0,
        "p2": 2.0 if command in (WAYPOINT, UNLIM, TURNS, TIME) else 0.0,
        "p3": 0.0,
        "p4": 0.0,
        "lat_e7": LAT if at_a_place else 0,
        "lon_e7": LON if at_a_place else 0,
        "alt_m": 10.0 if command in (WAYPOINT, UNLIM, TURNS, TIME, RTL, TAKEOFF) else 0.0,
    }
    return MissionItem(**(plain | changed))


HOME = item(WAYPOINT, frame=0)


def mission(*items: MissionItem) -> list[MissionItem]:
    return [HOME, *items]
