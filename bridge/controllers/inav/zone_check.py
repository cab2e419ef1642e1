# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission's way and INAV's geozones (navigation_geozone.c of 9.1.0; flown by tests/real_inav/test_zones.py).

In waypoint mode INAV acts at a border only if the zone has an action and the switch of ANGLE (HORIZON, COURSE HOLD,
CRUISE) is on as well (performeFenceAction). Of six returns on the SITL three flew around a zone, three through it, with
ANGLE on and off.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import inf, sqrt

from bridge.missions.flown_legs import Departure, FlownPath, Judgement, Leg, first_of
from bridge.model.ground_track import Place, distance_m, north_east_m, passing_distance_m
from protocols.msp.inav_places import Corner, FenceAction, Geozone
from reports.finding import News

#: Inclusive zones whose corners are further away are off (GEOZONE_INCLUSE_IGNORE_DISTANCE).
_IGNORED_M = 2000
#: A craft that stops drifts on, or back.
_DRIFT_M = 50


def judge_zones(zones: Sequence[Geozone], path: FlownPath, departure: Departure, stop_m: float) -> Iterable[Judgement]:
    """stop_m: INAV acts when the course over ground meets a border so far ahead, even if the leg ends before it."""
    blocked = [_blocks_arming(zones, place) for place in departure.places if place is not None]
    if blocked and blocked[0]:
        # A list is rejected only if INAV would not arm where the craft is or at the list's home.
        news = None if all(blocked) else News.DANGER
        yield Judgement(None, "", f"{departure.name.capitalize()} is {blocked[0]}: INAV does not arm", news)
    for zone in zones:
        if not zone.is_inclusive:
            near = [leg for leg in path.legs if _shares_height(zone, leg)]
            through = [leg for leg in near if any(_insides([zone], leg, stop_m if zone.action else 0))]
            yield from _met(through, f"geozone {zone.number}", zone.action)
    inclusive = [zone for zone in zones if zone.is_inclusive]
    if departure.place is not None and any(_is_inside(zone, departure.place) for zone in inclusive):
        action = max(zone.action for zone in inclusive)
        leaving = [leg for leg in path.legs if not all(_insides(inclusive, leg, stop_m if action else 0))]
        yield from _met(leaving, "the zone border", action)


def _met(legs: Sequence[Leg], what: str, action: int) -> Iterable[Judgement]:
    if not action:
        yield from first_of([(leg.cause, f"{what}: crossed, no action is set") for leg in legs], "lat_e7", News.NOTICE)
        return
    for leg in legs[:1]:
        stops = f"{'returns' if action == FenceAction.RTH else 'stops'} at {what} if ANGLE is on"
        yield Judgement(leg.cause, "lat_e7", f"{what}: flown through, or around" if leg.is_return else stops)


def zone_ahead(zones: Sequence[Geozone], place: Place, stop_m: float) -> str:
    """The nearest border at which INAV may have stopped here, or empty if there is none."""
    near = [(_border_m(zone, place), zone) for zone in zones if zone.action]
    metres, zone = min(near, key=lambda each: each[0], default=(inf, None))
    if zone is None or metres > stop_m + _DRIFT_M:
        return ""
    return f"{metres:.0f} m from the border of geozone {zone.number}"


def _border_m(zone: Geozone, place: Place) -> float:
    if zone.is_circle:
        return abs(distance_m(zone.corners[0], place) - zone.radius_cm / 100)
    return min(passing_distance_m(*side, place) for side in pairwise((*zone.corners, zone.corners[0])))


def _blocks_arming(zones: Sequence[Geozone], place: Place) -> str:
    """Where the place is if INAV does not arm there, else empty."""
    inside = [zone for zone in zones if zone.lowest_cm <= 0 and _is_inside(zone, place)]
    for zone in inside:
        if not zone.is_inclusive:
            return f"in geozone {zone.number}"
    near = [
        zone
        for zone in zones
        if zone.is_inclusive
        and min(distance_m(corner, place) for corner in zone.corners) - zone.radius_cm / 100 <= _IGNORED_M
    ]
    return "" if inside or not near else f"outside geozone {near[0].number}"


def _shares_height(zone: Geozone, leg: Leg) -> bool:
    """True unless the whole leg is above or below the zone. A zone above sea level is taken as without limits."""
    if leg.start_cm is None or leg.end_cm is None or zone.is_above_sea:
        return True
    is_above = zone.highest_cm and min(leg.start_cm, leg.end_cm) > zone.highest_cm
    return not (is_above or (zone.lowest_cm and max(leg.start_cm, leg.end_cm) < zone.lowest_cm))


def _is_inside(zone: Geozone, place: Place) -> bool:
    if zone.is_circle:
        return distance_m(zone.corners[0], place) < zone.radius_cm / 100
    is_inside = False
    for (north1, east1), (north2, east2) in _sides(zone, place):
        if (north1 > 0) != (north2 > 0) and east1 - north1 * (east2 - east1) / (north2 - north1) > 0:
            is_inside = not is_inside
    return is_inside


def _insides(zones: Sequence[Geozone], leg: Leg, ahead_m: float) -> Iterable[bool]:
    """For each part between two borders of the leg, and so far past its end: True if it is inside any of the zones."""
    last = 1.0 if leg.is_return else 1 + ahead_m / max(leg.length_m, 0.01)
    shares = sorted({0.0, last, *(share for zone in zones for share in _borders(zone, leg) if 0 < share < last)})
    for one, other in pairwise(shares):
        share = (one + other) / 2
        lat_e7 = leg.start.lat_e7 + round(share * (leg.end.lat_e7 - leg.start.lat_e7))
        middle = Corner(lat_e7, leg.start.lon_e7 + round(share * (leg.end.lon_e7 - leg.start.lon_e7)))
        yield any(_is_inside(zone, middle) for zone in zones)


def _borders(zone: Geozone, leg: Leg) -> Iterable[float]:
    """Where the line of the leg meets the zone's border, in shares of the length."""
    north, east = north_east_m(leg.start, leg.end)
    if not (length2 := north * north + east * east):
        return
    if zone.is_circle:
        to_north, to_east = north_east_m(leg.start, zone.corners[0])
        nearest = (north * to_north + east * to_east) / length2
        inner2 = (zone.radius_cm / 100) ** 2 - (to_north - nearest * north) ** 2 - (to_east - nearest * east) ** 2
        if inner2 > 0:
            yield from (nearest - sqrt(inner2 / length2), nearest + sqrt(inner2 / length2))
        return
    for (north1, east1), (north2, east2) in _sides(zone, leg.start):
        side_north, side_east = north2 - north1, east2 - east1
        if area := north * side_east - east * side_north:
            along_side = (north1 * -east + east1 * north) / -area
            if 0 <= along_side <= 1:
                yield (north1 * side_east - east1 * side_north) / area


def _sides(zone: Geozone, origin: Place) -> Iterable[tuple[tuple[float, float], tuple[float, float]]]:
    """Both ends of each side, metres to the north and east of the origin."""
    corners = [north_east_m(origin, corner) for corner in zone.corners]
    return zip(corners, corners[1:] + corners[:1], strict=True)
