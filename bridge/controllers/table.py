# SPDX-License-Identifier: GPL-3.0-or-later
"""Which dialect of missions is spoken with which flight controller: the one table."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bridge.controllers.harakiri.mavlink_missions import HarakiriMavlinkMissions
from bridge.controllers.harakiri.mission_store import HarakiriMissions
from bridge.controllers.inav.mission_store import InavMissions
from bridge.controllers.multiwii.mission_store import MultiwiiMissions
from bridge.controllers.nav.mission_store import NavCraft
from bridge.controllers.nav.rules import inav_profile, multiwii_profile
from bridge.fc.flight_controller import FlightController, Kind
from bridge.missions.fc_mission_store import AnyFcMissionStore


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a dialect may need besides the flight controller.

    is_armed: None while it is not known. home: where the flight controller says that home is, position: the same, or
    where it stands; degrees * 1e7. takeoff_max_m: the setting.
    """

    is_armed: Callable[[], bool | None]
    home: Callable[[], tuple[int, int] | None]
    position: Callable[[], tuple[int, int] | None]
    takeoff_max_m: int


def _harakiri(controller: FlightController, around: Surroundings) -> AnyFcMissionStore:
    assert controller.info is not None
    return HarakiriMissions(controller.info, around.takeoff_max_m)


def _harakiri_mavlink(_controller: FlightController, around: Surroundings) -> AnyFcMissionStore:
    return HarakiriMavlinkMissions(around.is_armed, around.takeoff_max_m)


def _inav(controller: FlightController, around: Surroundings) -> AnyFcMissionStore:
    return InavMissions(inav_profile(controller.capacity), _craft(controller, around))


def _multiwii(controller: FlightController, around: Surroundings) -> AnyFcMissionStore:
    return MultiwiiMissions(multiwii_profile(controller.capacity), _craft(controller, around))


def _craft(controller: FlightController, around: Surroundings) -> NavCraft:
    assert controller.arm_bit is not None
    return NavCraft(1 << controller.arm_bit, around.is_armed, around.home, around.position)


_DIALECTS: Mapping[Kind, Callable[[FlightController, Surroundings], AnyFcMissionStore]] = {
    Kind.HARAKIRI_MISSIONS: _harakiri,
    Kind.HARAKIRI_MAVLINK: _harakiri_mavlink,
    Kind.INAV: _inav,
    Kind.MULTIWII_NAV: _multiwii,
}


def dialect_of(controller: FlightController, around: Surroundings) -> AnyFcMissionStore | None:
    """Return how missions are put on this flight controller; None if it stores none."""
    make = _DIALECTS.get(controller.kind)
    return None if make is None else make(controller, around)
