# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's safehomes, landing approaches and geozones over MSP (src/main/fc/fc_msp.c, navigation_geozone.c of 9.1.0).

A change is in RAM until the configuration is written. Geozones take effect at the next boot, if the feature is on.
"""

import math
import struct

from protocols.msp.inav_places import (
    FEATURE,
    FW_APPROACH,
    GEOZONE,
    GEOZONE_FEATURE,
    GEOZONE_VERTEX,
    SAFEHOME,
    SET_FW_APPROACH,
    SET_GEOZONE,
    SET_GEOZONE_VERTEX,
    SET_SAFEHOME,
)
from simulator.board.flight import METRES_PER_DEGREE

SET_FEATURE = 37
_FEATURES = 0x2040_0806
_SAFEHOMES, _APPROACHES, _ZONES, _VERTICES = 8, 17, 63, 126
_SAFEHOME_SIZE, _APPROACH_SIZE = 9, 14
#: Type, shape, minimum and maximum altitude in cm, above sea level or not, action, number of vertices.
_ZONE = struct.Struct("<BBiiBBB")
#: Zone, number in it, latitude, longitude. A circle's second vertex has the radius in cm as latitude.
_VERTEX = struct.Struct("<bBii")
_PLACE = struct.Struct("<BBii")
_FREE = _VERTEX.pack(-1, 0, 0, 0)
_NO_VERTICES = _FREE * _VERTICES
_EXCLUSIVE, _CIRCLE = 0, 0
#: Inclusive zones whose corners are further away are off.
_IGNORED_M = 2000
#: The distance at which it notices a border, and the steps in which the way is looked at here.
_DETECTED_M, _SAMPLED_M = 150, 5
PLACES_SIZE = (
    1 + 4 + _SAFEHOMES * _SAFEHOME_SIZE + _APPROACHES * _APPROACH_SIZE + _ZONES * _ZONE.size + _VERTICES * _VERTEX.size
)


class PartialReplyError(Exception):
    """INAV's handler failed after it had written a part of the reply, which the error frame then has."""

    def __init__(self, payload: bytes) -> None:
        super().__init__()
        self.payload = payload


class InavPlaces:
    """`stored`: PLACES_SIZE bytes of the EEPROM. The first is set once they were saved."""

    def __init__(self, stored: memoryview, version: tuple[int, ...]) -> None:
        self._stored = stored
        self._has_approaches, self._has_zones = version >= (7, 1, 0), version >= (8, 0, 0)
        blank = _FEATURES.to_bytes(4, "little") + bytes(PLACES_SIZE - 5 - len(_NO_VERTICES)) + _NO_VERTICES
        content = bytes(stored[1:]) if stored[0] else blank
        self._features, rest = int.from_bytes(content[:4], "little"), content[4:]
        self._tables: list[list[bytes]] = []
        for count, size in ((_SAFEHOMES, _SAFEHOME_SIZE), (_APPROACHES, _APPROACH_SIZE), (_ZONES, _ZONE.size),
                            (_VERTICES, _VERTEX.size)):  # fmt: skip
            self._tables.append([rest[at * size : (at + 1) * size] for at in range(count)])
            rest = rest[count * size :]
        self._safehomes, self._approaches, self._zones, self._vertices = self._tables
        self._missions = 0
        self._zones_in_force = [*self._zones] if self._features & GEOZONE_FEATURE else []
        self._vertices_in_force = [_VERTEX.unpack(vertex) for vertex in self._vertices if vertex != _FREE]

    def waypoint_set(self, number: int, *, is_last: bool) -> None:
        """SET_WP erases the approach of a mission, counted from the boot. Past the last approach it erases all."""
        self._missions = 0 if number == 0 else (self._missions + is_last) % 256
        erased = (_SAFEHOMES + self._missions) % 256
        numbers = (erased,) if erased < _APPROACHES else range(_APPROACHES)
        for each in numbers:
            self._approaches[each] = bytes(_APPROACH_SIZE)

    def save(self) -> None:
        content = b"".join(map(b"".join, self._tables))
        self._stored[:] = b"\1" + self._features.to_bytes(4, "little") + content

    def answer(self, command: int, payload: bytes, behind: bytes = b"") -> bytes | None:
        """The payload of the reply, or None if an error, also for other commands. PartialReplyError.

        `behind`: the bytes of earlier requests that are still in the receive buffer, behind the payload.
        """
        index = payload[0] if payload else 0
        match command:
            case _ if command == FEATURE:
                return self._features.to_bytes(4, "little")
            case _ if command == SET_FEATURE and len(payload) == 4:
                self._features = int.from_bytes(payload, "little")
                return b""
            case _ if command == SAFEHOME:
                return bytes((index,)) + self._safehomes[index] if index < _SAFEHOMES else None
            case _ if command == SET_SAFEHOME and len(payload) == 1 + _SAFEHOME_SIZE and index < _SAFEHOMES:
                self._safehomes[index] = payload[1:]
                self._approaches[index] = bytes(_APPROACH_SIZE)
                return b""
            case _ if command == FW_APPROACH and self._has_approaches:
                return bytes((index,)) + self._approaches[index] if index < _APPROACHES else None
            case _ if command == SET_FW_APPROACH and len(payload) == 1 + _APPROACH_SIZE and index < _APPROACHES:
                self._approaches[index] = payload[1:-1] + bytes((payload[-1] > 0,))
                return b"" if self._has_approaches else None
        return self._about_zone(command, index, payload, behind) if self._has_zones and index < _ZONES else None

    def _about_zone(self, command: int, zone: int, payload: bytes, behind: bytes) -> bytes | None:
        match len(payload):
            case _ if command == GEOZONE:
                return bytes((zone,)) + self._zones[zone]
            case 14 if command == SET_GEOZONE:
                self._vertices[:] = [_FREE if vertex[0] == zone else vertex for vertex in self._vertices]
                self._zones[zone] = payload[1:]
                return b""
            case size if command == GEOZONE_VERTEX and size >= 2:
                return self._vertex(zone, payload[1])
            case 10 | 14 if command == SET_GEOZONE_VERTEX:
                _, number, lat, lon = _PLACE.unpack_from(payload)
                # For a circle it reads a radius even from a request that has none.
                radius = int.from_bytes((payload + behind)[10:14], "little", signed=True)
                is_circle = self._zones[zone][1] == _CIRCLE
                is_added = self._add(zone, number, lat, lon) and (not is_circle or self._add(zone, number + 1, radius))
                return b"" if is_added else None
        return None

    def _vertex(self, zone: int, number: int) -> bytes | None:
        found = self._find(self._vertices, zone, number)
        if found is None:
            return None
        reply = _PLACE.pack(zone, *found[1:])
        if self._zones[zone][1] != _CIRCLE:
            return reply
        radius = self._find(self._vertices, zone, number + 1)
        if radius is None:
            raise PartialReplyError(reply)
        return reply + radius[2].to_bytes(4, "little", signed=True)

    @staticmethod
    def _find(vertices: list[bytes], zone: int, number: int) -> tuple[int, int, int, int] | None:
        """The first of that number: a repeated request has added it twice."""
        unpacked = map(_VERTEX.unpack, vertices)
        return next((vertex for vertex in unpacked if vertex[:2] == (zone, number)), None)

    def _add(self, zone: int, number: int, lat: int, lon: int = 0) -> bool:
        if _FREE not in self._vertices or number >= _VERTICES:
            return False
        self._vertices[self._vertices.index(_FREE)] = _VERTEX.pack(zone, number, lat, lon)
        return True

    # -- In force since the boot -----------------------------------------------------------------------------

    def blocks_arming(self, position: tuple[int, int]) -> bool:
        """True on the ground inside an exclusive zone, or outside of the inclusive zones if one is near."""
        zones = [(number, _ZONE.unpack(zone)) for number, zone in enumerate(self._zones_in_force)]
        active = [(number, zone) for number, zone in zones if zone[6]]
        if sum(zone[6] for _, zone in active) != len(self._vertices_in_force):
            return False
        inside = [zone for number, zone in active if zone[2] <= 0 and self._is_inside(number, zone[1], position)]
        if any(zone[0] == _EXCLUSIVE for zone in inside):
            return True
        inclusive = [number for number, zone in active if zone[0] != _EXCLUSIVE]
        return not inside and any(self._distance_m(number, position) <= _IGNORED_M for number in inclusive)

    def action_ahead(self, here: tuple[int, int], target: tuple[int, int]) -> int:
        """The action of the first zone whose border is within 150 m on the course to a place, or past it; 0: none."""
        active = [(number, _ZONE.unpack(zone)) for number, zone in enumerate(self._zones_in_force)]
        active = [(number, zone) for number, zone in active if zone[6] and zone[5]]
        metres = max(_metres(here, target), 0.01)
        for step in range(1, _DETECTED_M // _SAMPLED_M + 1):
            share = step * _SAMPLED_M / metres
            place = tuple(round(start + share * (end - start)) for start, end in zip(here, target, strict=True))
            for number, zone in active:
                was_inside = self._is_inside(number, zone[1], here)
                enters = zone[0] == _EXCLUSIVE
                if was_inside != enters and self._is_inside(number, zone[1], (place[0], place[1])) == enters:
                    return int(zone[5])
        return 0

    def _corners(self, zone: int) -> list[tuple[float, float]]:
        corners = sorted(vertex for vertex in self._vertices_in_force if vertex[0] == zone)
        return [(lat, lon) for _, _, lat, lon in corners]

    def _is_inside(self, zone: int, shape: int, position: tuple[int, int]) -> bool:
        corners = self._corners(zone)
        if shape == _CIRCLE:
            return _metres(corners[0], position) < corners[1][0] / 100
        (lat, lon), is_inside = position, False
        for (lat1, lon1), (lat2, lon2) in zip(corners, corners[1:] + corners[:1], strict=True):
            if (lat1 > lat) != (lat2 > lat) and lon < lon1 + (lat - lat1) / (lat2 - lat1) * (lon2 - lon1):
                is_inside = not is_inside
        return is_inside

    def _distance_m(self, zone: int, position: tuple[int, int]) -> float:
        """To the nearest corner, or to a circle's border."""
        corners = self._corners(zone)
        if _ZONE.unpack(self._zones_in_force[zone])[1] == _CIRCLE:
            return _metres(corners[0], position) - corners[1][0] / 100
        return min(_metres(corner, position) for corner in corners)


def _metres(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Between two places in degrees * 1e7."""
    north = (other[0] - one[0]) / 1e7
    east = (other[1] - one[1]) / 1e7 * math.cos(math.radians(one[0] / 1e7))
    return math.hypot(north, east) * METRES_PER_DEGREE
