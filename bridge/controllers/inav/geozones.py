# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's geozones as a fence: circles and polygons. A fence's items cannot carry heights and actions.

They take effect after INAV's next start, and only with the feature GEOZONE (src/main/navigation/navigation_geozone.c).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite

from bridge.controllers.inav.places import InavPlaceStore, take
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, ask
from bridge.missions.list_check import ListCheck, missing_coordinate, refuse_frame, refuse_position
from bridge.model.ground_track import north_east_m
from protocols.mission_item import Command, Frame, MissionItem, MissionResult
from protocols.msp.frame import Direction, request
from protocols.msp.inav_places import (
    FEATURE,
    FEATURE_SIZE,
    GEOZONE,
    GEOZONE_FEATURE,
    GEOZONE_SIZE,
    GEOZONE_VERTEX,
    GEOZONES,
    SET_GEOZONE,
    SET_GEOZONE_VERTEX,
    VERTEX_SIZE,
    VERTICES,
    Corner,
    FenceAction,
    Geozone,
    decode_geozone,
    decode_vertex,
    empty_geozone,
    encode_read_geozone,
    encode_read_vertex,
)
from reports.finding import DROPPED, News, RejectingFinding, reject, reject_list
from reports.verdict import CLEARED_LIST, Result, Verdict

_FIRST_VERSION = (8, 0, 0)
_MAX_TRIES = 3
_LEAST_CORNERS = 3
#: North and east.
_Metres = tuple[float, float]
#: Centimetres in 31 bits.
_MAX_RADIUS_M = 20_000_000
_CIRCLES = {Command.FENCE_CIRCLE_INCLUSION: True, Command.FENCE_CIRCLE_EXCLUSION: False}
_POLYGONS = {Command.FENCE_POLYGON_INCLUSION: True, Command.FENCE_POLYGON_EXCLUSION: False}


def has_zones(board: FlightController) -> bool:
    return board.version is not None and board.version >= _FIRST_VERSION


def read_zones_in_force() -> Conversation[tuple[Geozone, ...] | None]:
    """All zones, or none if the feature is off or one of them lacks corners, or None if it does not answer."""
    is_on = yield from _ask_feature()
    if not is_on:
        return None if is_on is None else ()
    zones = yield from read_zones()
    return () if zones is not None and any(zone.missing for zone in zones) else zones


def _ask_feature() -> Conversation[bool | None]:
    """True if geozones are in force."""
    reply = yield from ask(request(FEATURE), FEATURE, FEATURE_SIZE)
    return None if reply is None else bool(int.from_bytes(reply.payload[:FEATURE_SIZE], "little") & GEOZONE_FEATURE)


def read_zones() -> Conversation[tuple[Geozone, ...] | None]:
    """Those that have corners, or None if it does not answer."""
    zones: list[Geozone] = []
    for number in range(GEOZONES):
        reply = yield from ask(encode_read_geozone(number), GEOZONE, GEOZONE_SIZE)
        head = None if reply is None else decode_geozone(reply.payload)
        if reply is None or (head is None and reply.direction is Direction.REPLY):
            return None
        if head is None or not head.vertices:
            continue
        corners: list[Corner] = []
        radius_cm = 0
        for vertex in range(head.vertices if head.is_polygon else 1):
            reply = yield from ask(encode_read_vertex(number, vertex), GEOZONE_VERTEX, VERTEX_SIZE)
            if reply is None:
                return None
            found = decode_vertex(reply.payload) if reply.direction is Direction.REPLY else None
            if found is not None:
                corners.append(found[0])
                radius_cm = found[1]
        heights = head.lowest_cm, head.highest_cm, head.is_above_sea
        zone = Geozone(number, head.is_inclusive, tuple(corners), radius_cm, *heights, head.action)
        zones.append(replace(zone, missing=head.vertices - zone.vertices))
    return tuple(zones)


class InavGeozones(InavPlaceStore[Geozone]):
    """Number their zones from 0: INAV 8.0 and 9.1 mix up the corners of others."""

    _is_in_force = True

    def pull(self) -> Conversation[tuple[Geozone, ...] | None]:
        is_on = yield from _ask_feature()
        found = None if is_on is None else (yield from read_zones())
        if is_on is not None and found is not None:
            self._is_in_force, self._known = is_on, found
        return found

    def items(self, records: Sequence[Geozone], sent_as: Mapping[int, int]) -> tuple[MissionItem, ...]:
        return fence_items(records)

    def _rules(self) -> "FenceRules":
        return FenceRules(self._known or (), is_feature_on=self._is_in_force)

    def _write(self, wanted: tuple[Geozone, ...], held: tuple[Geozone, ...]) -> Conversation[bool]:
        """Free the vertices of all zones that change before any new zone needs them."""
        for zone in held:
            if zone not in wanted and not (yield from take(SET_GEOZONE, empty_geozone(zone.number))):
                return False
        for zone in wanted:
            if zone not in held and not (yield from self._set(zone)):
                return False
        return True

    def _set(self, zone: Geozone) -> Conversation[bool]:
        """A corner must not be sent twice, INAV would have it twice: after a lost reply the zone begins again."""
        for _ in range(_MAX_TRIES):
            if not (yield from take(SET_GEOZONE, zone.head())):
                return False
            for number in range(len(zone.corners)):
                if not (yield from take(SET_GEOZONE_VERTEX, zone.vertex(number), tries=1)):
                    break
            else:
                return True
        return False


@dataclass(frozen=True, slots=True)
class FenceRules:
    """The rules for a fence. current: the zones on the board."""

    current: tuple[Geozone, ...] = ()
    is_feature_on: bool = True
    max_items: int = VERTICES
    has_home: bool = False

    def begin(self, count: int, _fallback_home: tuple[int, int] | None) -> "FenceCheck":
        return FenceCheck(count, self)


class FenceCheck(ListCheck):
    """The check of one fence. The corners of a polygon follow one another, each with their number in param1."""

    def __init__(self, count: int, rules: FenceRules) -> None:
        super().__init__(count)
        self._rules = rules
        self._zones: list[Geozone] = []
        #: The corners of the polygon that is arriving.
        self._corners: list[Corner] = []
        self._first: MissionItem | None = None

    def _judge(self, item: MissionItem) -> RejectingFinding | None:
        first = self._first
        if first is not None and (item.command, item.p1) != (first.command, first.p1):
            return self._cut_short(first)
        if item.command == Command.FENCE_RETURN_POINT:
            self._note(item, "command", item.command, DROPPED, "INAV returns to home or to a safehome")
            return None
        if item.command not in _CIRCLES and item.command not in _POLYGONS:
            return reject(MissionResult.UNSUPPORTED, item, "command", "not part of a fence")
        if rejection := refuse_position(item) or refuse_frame(item, needs_position=True):
            return rejection
        if missing_coordinate(item):
            return reject(MissionResult.INVALID_PARAM5_X, item, "lat_e7", "no Lat/Long")
        place = Corner(item.lat_e7 or 0, item.lon_e7 or 0)
        if item.command in _CIRCLES:
            return self._take_circle(item, place)
        return self._take_corner(item, place)

    def _take_circle(self, item: MissionItem, centre: Corner) -> RejectingFinding | None:
        radius_cm = round(item.p1 * 100) if isfinite(item.p1) and item.p1 <= _MAX_RADIUS_M else 0
        if radius_cm <= 0:
            return reject(MissionResult.INVALID_PARAM1, item, "p1", "no radius")
        return self._add(item, Geozone(0, _CIRCLES[Command(item.command)], (centre,), radius_cm))

    def _take_corner(self, item: MissionItem, corner: Corner) -> RejectingFinding | None:
        if not (isfinite(item.p1) and item.p1 >= _LEAST_CORNERS):
            return reject(MissionResult.INVALID_PARAM1, item, "p1", "a polygon needs three corners")
        self._first = first = self._first or item
        if corner in self._corners:
            return reject(MissionResult.INVALID, item, "lat_e7", "duplicate corner: remove it")
        self._corners.append(corner)
        if len(self._corners) < item.p1:
            return None
        corners, self._corners, self._first = tuple(self._corners), [], None
        if _crosses_itself(corners):
            return reject(MissionResult.INVALID, first, "command", "sides cross: move a corner")
        if not (area := _area(corners)):
            return reject(MissionResult.INVALID, first, "command", "corners on one line: move a corner")
        if area < 0:
            # INAV's way around a zone needs them anticlockwise.
            corners = (corners[0], *reversed(corners[1:]))
        return self._add(first, Geozone(0, _POLYGONS[Command(item.command)], corners))

    def _add(self, item: MissionItem, zone: Geozone) -> RejectingFinding | None:
        """Keep a zone, with the heights and the action of the present one of the same shape."""
        number = len(self._zones)
        known = next((each for each in self._rules.current if _shape(each) == _shape(zone)), None)
        kept = zone if known is None else known
        self._zones.append(replace(kept, number=number))
        if known is None:
            why = f"geozone {number} is new: no action at the border, no altitude limits (set them in INAV)"
            self._note(item, "p1", item.p1, item.p1, why, News.NOTICE)
        elif hidden := hidden_values(known):
            self._note(item, "p1", item.p1, item.p1, f"geozone {number} keeps {hidden}", News.NOTICE)
        if number >= GEOZONES or sum(each.vertices for each in self._zones) > VERTICES:
            why = f"only {GEOZONES} zones and {VERTICES} vertices fit (a circle takes two)"
            return reject(MissionResult.NO_SPACE, item, "command", why)
        return None

    def _cut_short(self, first: MissionItem) -> RejectingFinding:
        why = f"{len(self._corners)} of {first.p1:g} corners of this polygon"
        return reject(MissionResult.INVALID_PARAM1, first, "p1", why)

    def _refuse_kept_list(self) -> RejectingFinding | None:
        if self._first is not None:
            return self._cut_short(self._first)
        if not self._zones and self._taken:
            return reject_list(MissionResult.INVALID, self._count, "no usable zone")
        return None

    def _conclude(self) -> Verdict[Geozone]:
        zones = tuple(self._zones)
        if not zones:
            return CLEARED_LIST
        lost = [each for each in self._rules.current if hidden_values(each) and _shape(each) not in map(_shape, zones)]
        for zone in lost:
            self._say(f"Geozone {zone.number} is erased, with {hidden_values(zone)}")
        if not self._rules.is_feature_on:
            self._say("INAV's feature GEOZONE is off: the fence has no effect")
        elif zones != self._rules.current:
            self._say("INAV uses the new geozones after a restart", News.NOTICE)
        return Verdict(Result.ACCEPTED, MissionResult.ACCEPTED, zones, fence_items(zones), tuple(self._findings))


def fence_items(zones: Sequence[Geozone]) -> tuple[MissionItem, ...]:
    items: list[MissionItem] = []
    frame = int(Frame.GLOBAL_RELATIVE_ALT)
    for zone in zones:
        commands = _CIRCLES if zone.is_circle else _POLYGONS
        command = next(command for command, is_inclusive in commands.items() if is_inclusive == zone.is_inclusive)
        p1 = zone.radius_cm / 100 if zone.is_circle else float(len(zone.corners))
        for lat_e7, lon_e7 in zone.corners:
            items.append(MissionItem(len(items), int(command), frame, p1, 0, 0, 0, lat_e7, lon_e7, 0.0))
    return tuple(items)


def hidden_values(zone: Geozone) -> str:
    """The heights and the action, which a fence cannot show, or empty if there are none."""
    level = "above sea" if zone.is_above_sea else "above home"
    names = [f"floor {zone.lowest_cm / 100:g} m {level}"] if zone.lowest_cm else []
    names += [f"ceiling {zone.highest_cm / 100:g} m {level}"] if zone.highest_cm else []
    if zone.action:
        known = zone.action in FenceAction.__members__.values()
        names.append(f"action {FenceAction(zone.action).name if known else zone.action}")
    return ", ".join(names)


def _shape(zone: Geozone) -> tuple[object, ...]:
    return zone.is_inclusive, zone.corners, zone.radius_cm


def _crosses_itself(corners: Sequence[Corner]) -> bool:
    """True if two sides cross."""
    places = [north_east_m(corners[0], each) for each in corners]
    sides = list(zip(places, places[1:] + places[:1], strict=True))
    return any(
        _divides(*one, *other) and _divides(*other, *one)
        for at, one in enumerate(sides)
        for other in sides[at + 2 : len(sides) - (at == 0)]
    )


def _divides(one: _Metres, other: _Metres, start: _Metres, end: _Metres) -> bool:
    """True if the straight line through two places has `start` and `end` on different sides."""
    (north, east), (to_north, to_east) = one, (other[0] - one[0], other[1] - one[1])
    sides = [to_north * (place[1] - east) - to_east * (place[0] - north) for place in (start, end)]
    return sides[0] * sides[1] < 0


def _area(corners: Sequence[Corner]) -> int:
    """Twice the area in squares of 1e-7 degrees: 0 if all corners are on one line, negative if they are clockwise."""
    lat, lon = corners[0]
    # The short way across the date line.
    easts = ((each.lon_e7 - lon + 1_800_000_000) % 3_600_000_000 - 1_800_000_000 for each in corners)
    places = zip((each.lat_e7 - lat for each in corners), easts, strict=True)
    return sum(east1 * north2 - east2 * north1 for (north1, east1), (north2, east2) in pairwise(places))
