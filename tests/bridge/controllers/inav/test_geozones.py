# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules for a fence on INAV."""

from dataclasses import replace

import pytest

from bridge.controllers.inav.geozones import FenceRules, has_zones
from bridge.controllers.inav.profile import PROFILE
from bridge.fc.profile import FlightController
from bridge.missions.list_check import check_list
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.inav_places import Corner, Geozone
from reports.verdict import Verdict
from tests.bridge.controllers.inav.test_place_store import CIRCLE, FIELD, place, polygon

A, B, C = (0, 0), (0, 100), (100, 100)


def judged(*items: MissionItem, former: tuple[Geozone, ...] = ()) -> Verdict[Geozone]:
    return check_list(items, FenceRules(former))


def test_corners_are_stored_anticlockwise_from_the_first() -> None:
    corners = [Corner(453838000 + 100 * north, 84733000 + 100 * east) for north, east in (A, B, C)]
    for order in ((A, B, C), (A, C, B)):
        (zone,) = judged(*polygon(Command.FENCE_POLYGON_EXCLUSION, *order)).records
        assert zone == Geozone(0, False, tuple(corners))


@pytest.mark.parametrize(
    ("items", "ack"),
    [
        (FIELD[:3], MissionResult.INVALID_PARAM1),
        ([*FIELD[:3], CIRCLE], MissionResult.INVALID_PARAM1),
        (polygon(Command.FENCE_POLYGON_INCLUSION, A, B), MissionResult.INVALID_PARAM1),
        ([replace(CIRCLE, p1=0.0)], MissionResult.INVALID_PARAM1),
        ([replace(CIRCLE, p1=float("nan"))], MissionResult.INVALID_PARAM1),
        ([replace(CIRCLE, lat_e7=0)], MissionResult.INVALID_PARAM5_X),
        ([replace(CIRCLE, lat_e7=910_000_000)], MissionResult.INVALID_PARAM5_X),
        ([replace(CIRCLE, command=16)], MissionResult.UNSUPPORTED),
        ([replace(CIRCLE, lat_e7=453838000 + n) for n in range(64)], MissionResult.NO_SPACE),
        (polygon(Command.FENCE_POLYGON_INCLUSION, *((n, n * n) for n in range(127))), MissionResult.NO_SPACE),
        ([place(Command.FENCE_RETURN_POINT)], MissionResult.INVALID),
        (polygon(Command.FENCE_POLYGON_INCLUSION, (0, 0), (9, 9), (0, 9), (9, 0)), MissionResult.INVALID),
        (polygon(Command.FENCE_POLYGON_INCLUSION, A, B, C, A), MissionResult.INVALID),
        (polygon(Command.FENCE_POLYGON_INCLUSION, A, B, (0, 300)), MissionResult.INVALID),
    ],
)
def test_a_fence_that_does_not_fit_is_rejected(items: list[MissionItem], ack: MissionResult) -> None:
    assert judged(*items).ack is ack


@pytest.mark.parametrize(("version", "has"), [((7, 1, 2), False), ((8, 0, 0), True), (None, False)])
def test_inav_has_zones_since_8(version: tuple[int, int, int] | None, has: bool) -> None:
    assert has_zones(FlightController(PROFILE, "INAV", version=version)) is has


def test_a_return_point_is_dropped_and_named() -> None:
    verdict = judged(place(Command.FENCE_RETURN_POINT), CIRCLE)
    assert len(verdict.records) == 1
    assert "dropped, INAV returns to home or to a safehome" in verdict.findings[0].text()
