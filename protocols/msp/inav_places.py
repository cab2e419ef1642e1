# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's safehomes, landing approaches and geozones over MSP v2 (src/main/fc/fc_msp.c).

Approaches exist from 7.1 on, geozones from 8.0 on. A cut reply gives None.
"""

import struct
from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

from protocols.msp.frame import request

FEATURE = 36
FEATURE_SIZE = 4
GEOZONE_FEATURE = 1 << 4
SAFEHOME, SET_SAFEHOME, FW_APPROACH, SET_FW_APPROACH = 0x2038, 0x2039, 0x204A, 0x204B
GEOZONE, SET_GEOZONE, GEOZONE_VERTEX, SET_GEOZONE_VERTEX = 0x2210, 0x2211, 0x2212, 0x2213
#: MAX_SAFE_HOMES, MAX_GEOZONES_IN_CONFIG, MAX_VERTICES_IN_CONFIG. A circle takes two vertices.
SAFEHOMES, GEOZONES, VERTICES = 8, 63, 126
_SAFEHOME = struct.Struct("<BBii")
_APPROACH = struct.Struct("<BiiBhhB")
_GEOZONE = struct.Struct("<BBBiiBBB")
_VERTEX = struct.Struct("<BBii")
_RADIUS = struct.Struct("<i")
SAFEHOME_SIZE, APPROACH_SIZE, GEOZONE_SIZE = _SAFEHOME.size, _APPROACH.size, _GEOZONE.size
VERTEX_SIZE = _VERTEX.size + _RADIUS.size
#: Those of the safehomes, then those of the missions in INAV's store, from MISSION_APPROACH on.
APPROACHES = 17
MISSION_APPROACH = SAFEHOMES


class FwApproach(NamedTuple):
    """How an aeroplane lands. Heights above home, or above sea level.

    headings: of the landing, degrees. A negative one is not flown in the opposite direction, 0 is none.
    """

    number: int
    approach_cm: int = 0
    ground_cm: int = 0
    turns_right: bool = False
    headings: tuple[int, int] = (0, 0)
    is_above_sea: bool = False

    @property
    def is_empty(self) -> bool:
        return self == FwApproach(self.number)

    def pack(self) -> bytes:
        return _APPROACH.pack(*self[:4], *self.headings, self.is_above_sea)

    def directions(self) -> tuple[int, ...]:
        """In which it may land, degrees; empty: INAV does not use this approach."""
        found = [way for each in self.headings if each for way in ((abs(each),) if each < 0 else (each, each + 180))]
        return tuple(dict.fromkeys(each % 360 for each in found))


class Safehome(NamedTuple):
    """A place to return to instead of home; degrees * 1e7. number: from 0, also that of its approach.

    approach: None if the version has none, or if it was not read.
    """

    number: int
    enabled: bool
    lat_e7: int
    lon_e7: int
    approach: FwApproach | None = None

    def pack(self) -> bytes:
        """The payload of SET_SAFEHOME, which also erases the approach."""
        return _SAFEHOME.pack(*self[:4])

    def emptied(self) -> "Safehome":
        return Safehome(self.number, False, 0, 0, self.approach and FwApproach(self.number))


class FenceAction(IntEnum):
    """The action of a geozone at the border (navigation.h). A copter holds the position instead of avoiding it."""

    NONE = 0
    AVOID = 1
    POS_HOLD = 2
    RTH = 3


class Corner(NamedTuple):
    """Degrees * 1e7."""

    lat_e7: int
    lon_e7: int


@dataclass(frozen=True, slots=True)
class Geozone:
    """number: from 0. corners: of a polygon, or a circle's centre. radius_cm: 0 for a polygon.

    lowest_cm, highest_cm: 0 is the ground, and no limit. Above sea level if is_above_sea, else above home.
    missing: vertices that the board counts, but lacks. One is enough for INAV to turn all zones off.
    """

    number: int
    is_inclusive: bool
    corners: tuple[Corner, ...]
    radius_cm: int = 0
    lowest_cm: int = 0
    highest_cm: int = 0
    is_above_sea: bool = False
    action: int = field(default=FenceAction.NONE)
    missing: int = 0

    @property
    def is_circle(self) -> bool:
        return self.radius_cm > 0

    @property
    def vertices(self) -> int:
        """As INAV counts: the second one of a circle is the radius."""
        return 2 if self.is_circle else len(self.corners)

    def pack(self) -> bytes:
        """The payloads of SET_GEOZONE and then of each SET_GEOZONE_VERTEX."""
        return self.head() + b"".join(self.vertex(number) for number in range(len(self.corners)))

    def head(self) -> bytes:
        heights = self.lowest_cm, self.highest_cm
        kind = self.number, self.is_inclusive, not self.is_circle
        return _GEOZONE.pack(*kind, *heights, self.is_above_sea, self.action, self.vertices)

    def vertex(self, number: int) -> bytes:
        place = _VERTEX.pack(self.number, number, *self.corners[number])
        return place + _RADIUS.pack(self.radius_cm) if self.is_circle else place


class GeozoneHead(NamedTuple):
    """A reply to GEOZONE: a zone without the corners. is_polygon: else a circle."""

    number: int
    is_inclusive: bool
    is_polygon: bool
    lowest_cm: int
    highest_cm: int
    is_above_sea: bool
    action: int
    vertices: int


def encode_read_safehome(number: int) -> bytes:
    return request(SAFEHOME, bytes((number,)))


def encode_read_approach(number: int) -> bytes:
    return request(FW_APPROACH, bytes((number,)))


def encode_read_geozone(number: int) -> bytes:
    return request(GEOZONE, bytes((number,)))


def encode_read_vertex(zone: int, number: int) -> bytes:
    return request(GEOZONE_VERTEX, bytes((zone, number)))


def empty_geozone(number: int) -> bytes:
    """The payload of SET_GEOZONE that frees the zone's vertices."""
    return _GEOZONE.pack(number, 0, 0, 0, 0, 0, 0, 0)


def decode_safehome(payload: bytes) -> Safehome | None:
    if len(payload) < SAFEHOME_SIZE:
        return None
    number, enabled, lat_e7, lon_e7 = _SAFEHOME.unpack_from(payload)
    return Safehome(number, bool(enabled), lat_e7, lon_e7)


def decode_approach(payload: bytes) -> FwApproach | None:
    if len(payload) < APPROACH_SIZE:
        return None
    number, approach_cm, ground_cm, right, *headings, above_sea = _APPROACH.unpack_from(payload)
    return FwApproach(number, approach_cm, ground_cm, bool(right), (headings[0], headings[1]), bool(above_sea))


def decode_geozone(payload: bytes) -> GeozoneHead | None:
    if len(payload) < GEOZONE_SIZE:
        return None
    number, kind, shape, lowest, highest, above_sea, action, vertices = _GEOZONE.unpack_from(payload)
    return GeozoneHead(number, bool(kind), bool(shape), lowest, highest, bool(above_sea), action, vertices)


def decode_vertex(payload: bytes) -> tuple[Corner, int] | None:
    """Read a reply: the place and, of a circle, the radius in cm."""
    if len(payload) < _VERTEX.size:
        return None
    _, _, lat_e7, lon_e7 = _VERTEX.unpack_from(payload)
    radius = _RADIUS.unpack_from(payload, _VERTEX.size)[0] if len(payload) >= VERTEX_SIZE else 0
    return Corner(lat_e7, lon_e7), radius
