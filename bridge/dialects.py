"""Which dialect of missions is spoken with which flight controller: the one table."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bridge.flight_controller import FlightController, Kind
from bridge.harakiri import HarakiriMissions
from bridge.harakiri_mavlink import HarakiriMavlinkMissions
from bridge.mission_dialect import AnyDialect


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a dialect may need besides the flight controller.

    is_armed: None while it is not known. takeoff_max_m: the setting.
    """

    is_armed: Callable[[], bool | None]
    takeoff_max_m: int


def _harakiri(controller: FlightController, around: Surroundings) -> AnyDialect:
    assert controller.info is not None
    return HarakiriMissions(controller.info, around.takeoff_max_m)


def _harakiri_mavlink(_controller: FlightController, around: Surroundings) -> AnyDialect:
    return HarakiriMavlinkMissions(around.is_armed, around.takeoff_max_m)


_DIALECTS: Mapping[Kind, Callable[[FlightController, Surroundings], AnyDialect]] = {
    Kind.HARAKIRI_MISSIONS: _harakiri,
    Kind.HARAKIRI_MAVLINK: _harakiri_mavlink,
}


def dialect_of(controller: FlightController, around: Surroundings) -> AnyDialect | None:
    """Return how missions are put on this flight controller; None if it stores none."""
    make = _DIALECTS.get(controller.kind)
    return None if make is None else make(controller, around)
