# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission and INAV's geozones. In its waypoint mode INAV acts at no border, so a leg through a zone is flown."""

from collections.abc import Iterable, Sequence

from bridge.controllers.nav.judgement import Departure, Judgement
from bridge.model.ground_track import Place, distance_m, north_east_m, passing_distance_m
from protocols.msp.inav_places import Geozone
from protocols.msp.nav import LEGS, NavRecord

#: Inclusive zones whose corners are further away are off (GEOZONE_INCLUSE_IGNORE_DISTANCE).
_IGNORED_M = 2000


def judge_zones(
    zones: Sequence[Geozone], records: Sequence[NavRecord], heights_cm: Sequence[int | None], departure: Departure
) -> Iterable[Judgement]:
    """heights_cm: of each record above home; None if unknown."""
    blocked = [why for place in departure.places if (why := _blocks_arming(zones, place))]
    if blocked and len(blocked) == len(departure.places):
        yield Judgement(None, "", f"Home is {blocked[0]}: INAV would not arm", None)
        return
    inclusive = [zone for zone in zones if zone.is_inclusive]
    starts_inside = any(_is_inside(zone, start) for zone in inclusive for start in departure.places[:1])
    before: tuple[NavRecord, int | None] | None = None
    for place, (record, height_cm) in enumerate(zip(records, heights_cm, strict=True)):
        if record.action not in LEGS:
            continue
        start, start_cm = before or (record, height_cm)
        for zone in zones:
            is_through = not zone.is_inclusive and _crosses(zone, start, record)
            if is_through and _shares_height(zone, start_cm, height_cm):
                why = f"passes through geozone {zone.number} (exclusive): INAV does not stop a mission there"
                yield Judgement(place, "lat_e7", why)
        if starts_inside and not any(_is_inside(zone, record) for zone in inclusive):
            yield Judgement(place, "lat_e7", "outside of the inclusive geozones: INAV does not stop a mission there")
        before = record, height_cm


def _blocks_arming(zones: Sequence[Geozone], place: Place) -> str:
    """Where the place is if INAV does not arm there; else empty."""
    inside = [zone for zone in zones if zone.lowest_cm <= 0 and _is_inside(zone, place)]
    for zone in inside:
        if not zone.is_inclusive:
            return f"inside geozone {zone.number} (exclusive)"
    near = [zone for zone in zones if zone.is_inclusive and _distance_m(zone, place) <= _IGNORED_M]
    return "" if inside or not near else f"outside geozone {near[0].number} (inclusive)"


def _shares_height(zone: Geozone, one_cm: int | None, other_cm: int | None) -> bool:
    """True unless the whole leg is above or below the zone; a zone above sea level is taken as without limits."""
    if one_cm is None or other_cm is None or zone.is_above_sea:
        return True
    is_above = zone.highest_cm and min(one_cm, other_cm) > zone.highest_cm
    return not (is_above or (zone.lowest_cm and max(one_cm, other_cm) < zone.lowest_cm))


def _distance_m(zone: Geozone, place: Place) -> float:
    """To the nearest corner, or to a circle's border."""
    return min(distance_m(corner, place) for corner in zone.corners) - zone.radius_cm / 100


def _is_inside(zone: Geozone, place: Place) -> bool:
    if zone.is_circle:
        return distance_m(zone.corners[0], place) < zone.radius_cm / 100
    is_inside = False
    for (north1, east1), (north2, east2) in _sides(zone, place):
        if (north1 > 0) != (north2 > 0) and east1 - north1 * (east2 - east1) / (north2 - north1) > 0:
            is_inside = not is_inside
    return is_inside


def _crosses(zone: Geozone, start: Place, end: Place) -> bool:
    """True if the straight line from start to end touches the zone."""
    if zone.is_circle:
        return passing_distance_m(start, end, zone.corners[0]) < zone.radius_cm / 100
    if _is_inside(zone, start) or _is_inside(zone, end):
        return True
    leg = north_east_m(start, end)
    for one, other in _sides(zone, start):
        side = other[0] - one[0], other[1] - one[1]
        to_end = leg[0] - one[0], leg[1] - one[1]
        sides_apart = _cross(leg, one) * _cross(leg, other) < 0
        if sides_apart and _cross(side, (-one[0], -one[1])) * _cross(side, to_end) < 0:
            return True
    return False


def _sides(zone: Geozone, origin: Place) -> Iterable[tuple[tuple[float, float], tuple[float, float]]]:
    """Both ends of each side, metres to the north and east of the origin."""
    corners = [north_east_m(origin, corner) for corner in zone.corners]
    return zip(corners, corners[1:] + corners[:1], strict=True)


def _cross(one: tuple[float, float], other: tuple[float, float]) -> float:
    return one[0] * other[1] - one[1] * other[0]
