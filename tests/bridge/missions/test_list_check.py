# SPDX-License-Identifier: GPL-3.0-or-later
"""What all boards' rules share: counts, home, rejections."""

import math
from dataclasses import replace

import pytest

from bridge.controllers.harakiri.check import HarakiriCheck, HarakiriRules
from bridge.missions.list_check import check_count, check_list
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.mission import WpCommand, WpRecord
from reports.finding import CLEARED, REJECTED
from reports.verdict import Result
from tests.bridge.controllers.harakiri.test_check import INF, NAN, PROFILE, assert_rejected, verdict_on
from tests.support.rule_items import (
    HERE,
    HOME,
    LAND,
    LAT,
    LON,
    ROI,
    ROI_NONE,
    RTL,
    SET_ROI,
    SPEED,
    TAKEOFF,
    TIME,
    UNLIM,
    WAYPOINT,
    item,
    mission,
)


def test_an_empty_upload_clears_the_list() -> None:
    verdict = check_list([], PROFILE)
    assert (verdict.result, verdict.ack, verdict.records) == (Result.CLEARED, MissionResult.ACCEPTED, ())


@pytest.mark.parametrize("dropped", [item(SPEED), item(WAYPOINT, lon_e7=0), item(TIME, alt_m=NAN), item(ROI_NONE)])
def test_a_list_of_which_only_home_is_kept_clears(dropped: MissionItem) -> None:
    for items in (mission(dropped), mission(dropped, item(SPEED), item(SPEED))):
        verdict = check_list(items, PROFILE)
        assert (verdict.result, verdict.ack, verdict.records) == (Result.CLEARED, MissionResult.ACCEPTED, ())
        assert (verdict.findings[-1].was, verdict.findings[-1].becomes) == (len(items), CLEARED)
        assert "erased" in verdict.findings[-1].text()


BLANK = MissionItem(0, WAYPOINT, 3, 0.0, 0.0, 0.0, NAN, 0, None, 0.0)
#: The list, the number of the item that rejects it, the ack and the field.
REJECTIONS: list[tuple[list[MissionItem], int | None, MissionResult, str]] = [
    *(([home], None, MissionResult.INVALID, "count") for home in (
        HOME, replace(HOME, frame=3), replace(HOME, lat_e7=0, lon_e7=0, alt_m=0.0, p2=0.0), replace(BLANK, p1=1.0),
        replace(BLANK, p2=1.0), replace(BLANK, p3=1.0), replace(BLANK, p4=1.0), replace(BLANK, alt_m=1.0),
    )),
    *(
        ([item(command), item(WAYPOINT)], 0, MissionResult.INVALID, "command")
        for command in (0, UNLIM, RTL, TAKEOFF, ROI, SPEED)
    ),
    ([replace(HOME, frame=2), item(WAYPOINT)], 0, MissionResult.UNSUPPORTED_FRAME, "frame"),
    ([replace(HOME, alt_m=NAN), item(WAYPOINT)], 0, MissionResult.INVALID_PARAM7, "alt_m"),
    ([replace(HOME, alt_m=INF), item(WAYPOINT)], 0, MissionResult.INVALID_PARAM7, "alt_m"),
]  # fmt: skip


def test_home_alone_or_another_item_as_home_rejects_the_list() -> None:
    for items, seq, ack, field in REJECTIONS:
        assert_rejected(check_list(items, PROFILE), ack, seq, field)


def test_a_single_item_of_zeros_clears_for_mavsdk() -> None:
    assert check_list([BLANK], PROFILE).result is Result.CLEARED


@pytest.mark.parametrize("capacity", [2, 120, 146])
def test_more_than_the_capacity_is_refused_with_no_space(capacity: int) -> None:
    profile = HarakiriRules(capacity=capacity)
    full = mission(*[item(WAYPOINT)] * (capacity - 1))
    assert check_list(full, profile).result is Result.ACCEPTED
    assert_rejected(check_list([*full, item(WAYPOINT)], profile), MissionResult.NO_SPACE, None, "count")
    rejection = check_count(capacity + 1, profile)
    assert rejection is not None
    assert rejection.ack is MissionResult.NO_SPACE
    assert check_count(capacity, profile) is None


def test_count_0_is_accepted() -> None:
    assert check_count(0, PROFILE) is None


@pytest.mark.parametrize(
    "home", [replace(HOME, lat_e7=0, lon_e7=0), replace(HOME, lat_e7=None), replace(HOME, lon_e7=0)]
)
def test_home_without_coordinates_gets_the_flight_controllers_position(home: MissionItem) -> None:
    items = [home, item(WAYPOINT)]
    lat, lon = LAT + 11, LON + 22
    verdict = check_list(items, PROFILE, fallback_home=(lat, lon))
    assert (verdict.items[0].lat_e7, verdict.items[0].lon_e7) == (lat, lon)
    assert [(f.seq, f.field, f.becomes) for f in verdict.findings] == [(0, "lat_e7", lat), (0, "lon_e7", lon)]
    for no_fix in (None, (0, 0), (11, 0)):
        rejected = check_list(items, PROFILE, fallback_home=no_fix)
        assert (rejected.ack, rejected.findings[-1].seq) == (MissionResult.INVALID_PARAM5_X, 0)


def test_homes_own_coordinates_take_precedence() -> None:
    verdict = check_list([HOME, item(WAYPOINT)], PROFILE, fallback_home=(11, 22))
    assert (verdict.items[0].lat_e7, verdict.items[0].lon_e7) == (LAT, LON)


@pytest.mark.parametrize("frame", [0, 5, 10, 11])
def test_homes_height_is_kept_regardless_of_the_frame(frame: int) -> None:
    verdict = check_list([replace(HOME, frame=frame, alt_m=584.0), item(WAYPOINT)], PROFILE)
    assert (verdict.items[0].frame, verdict.items[0].alt_m) == (0, 584.0)
    # Relative to the terrain: it is probably no home.
    assert [finding.field for finding in verdict.findings] == ["frame"] * (frame >= 10)


def test_home_is_a_waypoint_in_every_other_respect() -> None:
    home = replace(HOME, p1=9.0, p2=math.nan, p3=4.0, p4=1.0, alt_m=0.0)
    verdict = check_list([home, item(WAYPOINT)], PROFILE)
    assert verdict.records[0] == WpRecord(LAT, LON, 2, 0, 1, 2, 0, WpCommand.WAYPOINT)
    assert [f.field for f in verdict.findings] == ["p1", "p2", "p3", "p4", "alt_m"]


@pytest.mark.parametrize(
    ("seq", "faulty"),
    [
        (0, item(LAND)),
        (0, replace(HOME, lat_e7=0)),
        (2, item(WAYPOINT, frame=1)),
        (2, item(WAYPOINT, lat_e7=900_000_001)),
        (2, item(TAKEOFF)),
        (2, item(LAND)),
        (2, item(UNLIM)),
        (5, item(SET_ROI)),
    ],
)
def test_a_rejection_comes_with_the_item_and_is_final(seq: int, faulty: MissionItem) -> None:
    items = [HOME] + [item(WAYPOINT)] * 5
    items[seq] = faulty
    check = HarakiriCheck(PROFILE, len(items))
    answers = [check.take(each) for each in items]
    assert answers[:seq] == [None] * seq
    assert answers[seq] is not None
    assert answers[seq].finding.seq == seq  # type: ignore[union-attr]
    assert set(map(id, answers[seq:])) == {id(answers[seq])}
    verdict = check.finish()
    assert (verdict.result, verdict.findings[-1]) == (Result.REJECTED, answers[seq].finding)  # type: ignore[union-attr]


def test_an_incomplete_list_cannot_be_judged() -> None:
    check = HarakiriCheck(PROFILE, 3)
    check.take(HOME)
    check.take(item(WAYPOINT))
    with pytest.raises(ValueError, match="2 of 3"):
        check.finish()


def test_findings_before_a_rejection_are_kept() -> None:
    verdict = verdict_on(item(WAYPOINT, p1=5), item(LAND), item(WAYPOINT))
    assert [(f.seq, f.becomes) for f in verdict.findings] == [(1, 1), (2, REJECTED)]


def test_items_are_numbered_by_position() -> None:
    verdict = check_list([HOME, item(WAYPOINT, seq=77, p1=5, **HERE)], PROFILE)
    assert [f.seq for f in verdict.findings] == [1]
