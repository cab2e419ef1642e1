# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's safehomes and geozones on the wire."""

import struct

import pytest

from protocols.msp.inav_places import (
    Corner,
    FwApproach,
    Geozone,
    GeozoneHead,
    Safehome,
    decode_approach,
    decode_geozone,
    decode_safehome,
    decode_vertex,
    empty_geozone,
)

CIRCLE = Geozone(5, True, (Corner(453838000, -84733000),), 7550, -100, 12000, True, 3)
APPROACH = struct.pack("<BiiBhhB", 8, 5000, -350, 1, 90, -10, 1)
SQUARE = Geozone(0, False, tuple(Corner(lat, lon) for lat, lon in ((0, 0), (0, 9), (9, 9), (9, 0))))


@pytest.mark.parametrize(("zone", "polygon"), [(CIRCLE, False), (SQUARE, True)])
def test_a_zone_is_read_as_it_was_set(zone: Geozone, polygon: bool) -> None:
    head = decode_geozone(zone.head())
    heights = zone.lowest_cm, zone.highest_cm, zone.is_above_sea
    assert head == GeozoneHead(zone.number, zone.is_inclusive, polygon, *heights, zone.action, zone.vertices)
    read = [decode_vertex(zone.vertex(number)) for number in range(len(zone.corners))]
    assert read == [(corner, zone.radius_cm) for corner in zone.corners]
    assert len(zone.head()) == 14
    assert len(zone.vertex(0)) == 14 - 4 * polygon


def test_truncated_replies_are_rejected() -> None:
    safehome = Safehome(7, True, 453838000, -84733000)
    assert decode_safehome(safehome.pack()) == safehome
    assert decode_safehome(safehome.pack()[: 10 - 1]) is None
    assert decode_approach(APPROACH[:-1]) is None
    assert decode_geozone(CIRCLE.head()[:-1]) is None
    assert decode_vertex(CIRCLE.vertex(0)[:9]) is None


@pytest.mark.parametrize(
    ("headings", "directions"),
    [((0, 0), ()), ((90, 0), (90, 270)), ((-90, 0), (90,)), ((300, -10), (300, 120, 10)), ((90, 270), (90, 270))],
)
def test_an_approach_names_the_directions_of_landing(headings: tuple[int, int], directions: tuple[int, ...]) -> None:
    approach = decode_approach(APPROACH)
    assert approach == FwApproach(8, 5000, -350, turns_right=True, headings=(90, -10), is_above_sea=True)
    assert approach._replace(headings=headings).directions() == directions


def test_an_empty_zone_has_0_vertices() -> None:
    head = decode_geozone(empty_geozone(9))
    assert head is not None
    assert (head.number, head.vertices) == (9, 0)
