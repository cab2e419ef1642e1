# SPDX-License-Identifier: GPL-3.0-or-later
"""Every row of docs/mission-rules.md, one by one."""

import math
from dataclasses import replace
from typing import Any

import pytest

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.missions.list_check import check_list
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.mission import WpCommand, WpRecord
from reports.finding import DROPPED, REJECTED, News
from reports.verdict import Result, Verdict
from tests.support.rule_items import (
    LAND,
    LAT,
    LON,
    ROI,
    ROI_LOCATION,
    ROI_NONE,
    RTL,
    SET_ROI,
    SPEED,
    TAKEOFF,
    TIME,
    TURNS,
    UNLIM,
    WAYPOINT,
    item,
    mission,
)

PROFILE = HarakiriRules()
NAN, INF = math.nan, math.inf


def verdict_on(*items: MissionItem, profile: HarakiriRules = PROFILE, **kwargs: Any) -> Verdict[WpRecord]:
    return check_list(mission(*items), profile, **kwargs)


def placed(tested: MissionItem) -> tuple[list[MissionItem], int]:
    """A valid list with the tested item in an allowed position, and the item's number."""
    match tested.command:
        case 22:
            return mission(tested, item(WAYPOINT)), 1
        case 17 | 21:
            return mission(item(WAYPOINT), tested), 2
        case _:
            return mission(item(WAYPOINT), tested, item(WAYPOINT)), 2


def stored(tested: MissionItem, profile: HarakiriRules = PROFILE) -> tuple[MissionItem, dict[str, tuple[Any, Any]]]:
    """The item as it reads back, and its changes: field to (was, becomes)."""
    items, seq = placed(tested)
    verdict = check_list(items, profile)
    assert verdict.result is Result.ACCEPTED
    assert len(verdict.items) == len(items)
    return verdict.items[seq], {
        f.field: (f.was, f.becomes) for f in verdict.findings if f.seq == seq and f.was != f.becomes
    }


# ---------------------------------------------------------------- values


@pytest.mark.parametrize("command", [WAYPOINT, UNLIM, TURNS, TIME, RTL, LAND, TAKEOFF, ROI, ROI_LOCATION, SET_ROI])
def test_a_valid_item_is_stored_unchanged_without_a_finding(command: int) -> None:
    items, seq = placed(item(command))
    verdict = check_list(items, PROFILE)
    assert verdict.findings == ()
    assert replace(verdict.items[seq], seq=0) == items[seq]


VALUES = [
    # p1: fly through or brake
    *[(WAYPOINT, "p1", sent, becomes) for sent, becomes in [(0, 0), (1, 1), (1.9, 1), (0.9, 0), (7, 1), (-1, 0)]],
    *[(WAYPOINT, "p1", sent, becomes) for sent, becomes in [(1e30, 1), (NAN, 0), (INF, 0), (-INF, 0)]],
    *[(UNLIM, "p1", sent, 0) for sent in (0, 1, -3, NAN)],
    *[(TURNS, "p1", sent, becomes) for sent, becomes in [(1, 1), (-1, -1), (127, 127), (128, 127), (-127, -127)]],
    *[(TURNS, "p1", sent, becomes) for sent, becomes in [(-128, -127), (0, 1), (0.9, 1), (-0.9, 1), (NAN, 1)]],
    *[(TURNS, "p1", sent, becomes) for sent, becomes in [(2.7, 2), (-2.7, -2), (1e30, 127), (-1e30, -127), (INF, 1)]],
    *[(TIME, "p1", sent, becomes) for sent, becomes in [(1, 1), (255, 255), (256, 255), (0, 1), (-5, 1), (30.9, 30)]],
    *[(TIME, "p1", sent, becomes) for sent, becomes in [(NAN, 1), (1e30, 255), (INF, 1), (0.99, 1)]],
    # p2: hit radius of at least 2 m
    *[
        (command, "p2", sent, becomes)
        for command in (WAYPOINT, UNLIM, TURNS, TIME)
        for sent, becomes in [(2, 2), (0, 2), (1, 2), (2.9, 2), (255, 255), (256, 255), (-9, 2), (NAN, 2), (1e30, 255)]
    ],
    # p3 is never used; p4 only with a region of interest (below)
    *[(command, "p3", sent, 0) for command in (WAYPOINT, UNLIM, TURNS, TIME) for sent in (0, 5, -5, NAN, INF)],
    *[(command, "p4", sent, 0) for command in (WAYPOINT, UNLIM, TURNS, TIME) for sent in (0, 1, 90, NAN)],
    # commands that use no parameters
    *[
        (command, field, sent, 0)
        for command in (RTL, LAND, TAKEOFF, ROI, ROI_LOCATION, SET_ROI)
        for field in ("p1", "p2", "p3", "p4")
        for sent in (0, 1, -2.5, NAN)
    ],
    # height
    *[
        (command, "alt_m", sent, becomes)
        for command in (WAYPOINT, UNLIM, TURNS, TIME, RTL)
        for sent, becomes in [(1, 1), (0, 2), (0.99, 2), (-0.99, 2), (-1, -1), (-50.7, -50), (18.5, 18)]
    ],
    *[(WAYPOINT, "alt_m", sent, becomes) for sent, becomes in [(32767, 32767), (32768, 32767), (-32768, -32767)]],
    *[(WAYPOINT, "alt_m", sent, becomes) for sent, becomes in [(-40000, -32767), (1e30, 32767), (-1e30, -32767)]],
    *[(TAKEOFF, "alt_m", sent, becomes) for sent, becomes in [(2, 2), (15, 15), (15.9, 15), (16, 15), (255, 15)]],
    *[(TAKEOFF, "alt_m", sent, becomes) for sent, becomes in [(1.9, 2), (0, 2), (-5, 2), (1e30, 15)]],
    *[(command, "alt_m", sent, 0) for command in (LAND, ROI, ROI_LOCATION, SET_ROI) for sent in (0, 5, -5, NAN, INF)],
    # position
    *[(command, "lat_e7", sent, 0) for command in (RTL, LAND, TAKEOFF) for sent in (0, LAT, None, 2**31 - 1)],
    *[(command, "lon_e7", sent, 0) for command in (RTL, LAND, TAKEOFF) for sent in (0, LON, None, -(2**31))],
    *[(command, "lat_e7", sent, sent) for command in (WAYPOINT, UNLIM, ROI) for sent in (1, -1, 9 * 10**8, -9 * 10**8)],
    *[(command, "lon_e7", sent, sent) for command in (TURNS, TIME, SET_ROI) for sent in (1, 18 * 10**8, -18 * 10**8)],
]


def test_a_truncated_or_clamped_value_is_a_finding() -> None:
    for command, field, sent, becomes in VALUES:
        case = f"command {command}, {field} {sent}"
        held, findings = stored(item(command, **{field: sent}))
        assert getattr(held, field) == becomes, case
        was = None if sent is None or math.isnan(sent) else sent
        assert findings == ({} if (was or 0) == becomes else {field: (was, becomes)}), case


@pytest.mark.parametrize(
    ("wp_radius_cm", "least"),
    [(0, 0), (1, 1), (99, 1), (100, 1), (101, 2), (200, 2), (201, 3), (2000, 20), (25500, 255), (65535, 255)],
)
def test_gps_wp_radius_is_rounded_up_to_whole_metres(wp_radius_cm: int, least: int) -> None:
    profile = HarakiriRules(wp_radius_cm=wp_radius_cm)
    for sent in (0, NAN, least - 1):
        assert stored(item(WAYPOINT, p2=sent), profile)[0].p2 == least


def test_the_maximum_take_off_height_is_a_setting() -> None:
    assert stored(item(TAKEOFF, alt_m=80), HarakiriRules(takeoff_max_m=30))[0].alt_m == 30


def test_records_have_the_layout_of_the_firmware() -> None:
    verdict = verdict_on(
        item(TAKEOFF, alt_m=5),
        item(SET_ROI, lat_e7=1, lon_e7=-2),
        item(WAYPOINT, p1=1, p2=3, p4=1, alt_m=-7),
        item(TIME, p1=200, p4=1),
        item(TURNS, p1=-3),
        item(RTL, alt_m=9),
        item(UNLIM, p4=1),
    )
    assert verdict.records == (
        WpRecord(LAT, LON, 10, 0, 0, 2, 0, WpCommand.WAYPOINT),
        WpRecord(0, 0, 5, 0, 0, 0, 0, WpCommand.TAKEOFF),
        WpRecord(1, -2, 0, 0, 0, 0, 0, WpCommand.SETROI),
        WpRecord(LAT, LON, -7, 1, 1, 3, 0, WpCommand.WAYPOINT),
        WpRecord(LAT, LON, 10, 1, 200, 2, 0, WpCommand.LOITER_TIME),
        WpRecord(LAT, LON, 10, 0, 0, 2, -3, WpCommand.LOITER_TURNS),
        WpRecord(0, 0, 9, 0, 0, 0, 0, WpCommand.RETURN_TO_LAUNCH),
        WpRecord(LAT, LON, 10, 1, 0, 2, 0, WpCommand.LOITER_UNLIM),
    )
    assert [held.seq for held in verdict.items] == list(range(8))
    assert [held.frame for held in verdict.items] == [0] + [3] * 7
    assert verdict.sent_as == {2: SET_ROI}


# ---------------------------------------------------------------- nose on the region of interest


@pytest.mark.parametrize("roi", [ROI, ROI_LOCATION, SET_ROI])
def test_with_a_known_roi_p4_turns_the_nose_to_it(roi: int) -> None:
    for sent, becomes in [(1, 1), (1.5, 1), (90, 1), (0.9, 0), (0, 0), (-1, 0), (NAN, 0)]:
        verdict = verdict_on(
            item(roi), item(WAYPOINT, p4=sent), item(TIME, p4=sent), item(TURNS, p4=sent), item(UNLIM, p4=sent)
        )
        assert [held.p4 for held in verdict.items[2:]] == [becomes, becomes, 0, becomes], sent


def test_a_roi_stays_known_until_roi_none() -> None:
    wish = item(WAYPOINT, p4=1)
    verdict = verdict_on(wish, item(ROI), wish, item(SPEED), wish, item(ROI_NONE), wish, item(SET_ROI), wish)
    assert [held.p4 for held in verdict.items if held.command == WAYPOINT] == [0, 0, 1, 1, 0, 1]
    assert [(f.seq, f.field, f.becomes) for f in verdict.findings] == [
        (1, "p4", 0),
        (4, "command", DROPPED),
        (6, "command", DROPPED),
        (7, "p4", 0),
    ]


@pytest.mark.parametrize("missing", [{"lat_e7": 0}, {"lon_e7": None}])
def test_a_dropped_roi_is_not_known(missing: dict[str, int | None]) -> None:
    verdict = verdict_on(item(ROI, **missing), item(WAYPOINT, p4=1))
    assert [held.p4 for held in verdict.items] == [0, 0]
    assert [f.becomes for f in verdict.findings] == [DROPPED, 0]


# ---------------------------------------------------------------- dropped items


#: Each item with the field for which it is dropped.
DROPS = [
    *((item(command), "command") for command in (0, 1, SPEED, 82, 177, 115, 206, 400, 65535)),
    *(
        (item(command, **{field: sent}), field)
        for command in (WAYPOINT, TURNS, TIME, ROI, ROI_LOCATION, SET_ROI)
        for field in ("lat_e7", "lon_e7")
        for sent in (0, None)
    ),
    *((item(command, alt_m=height), "alt_m") for command in (WAYPOINT, TURNS, TIME) for height in (NAN, INF, -INF)),
]


def test_an_item_that_is_unknown_or_lacks_a_place_or_height_is_dropped() -> None:
    for sent, field in DROPS:
        verdict = verdict_on(item(WAYPOINT), sent, item(RTL))
        assert [held.command for held in verdict.items] == [WAYPOINT, WAYPOINT, RTL], sent
        assert [(f.seq, f.field, f.becomes) for f in verdict.findings] == [(2, field, DROPPED)]
        assert field == "alt_m" or verdict.findings[0].was == getattr(sent, field)


def test_a_last_loiter_without_coordinates_is_dropped() -> None:
    assert len(verdict_on(item(WAYPOINT), item(UNLIM, lat_e7=0)).items) == 2


@pytest.mark.parametrize("height", [NAN, INF, -INF])
def test_a_return_without_a_finite_height_gets_the_minimum(height: float) -> None:
    verdict = verdict_on(item(WAYPOINT), item(RTL, alt_m=height))
    assert (verdict.items[2].command, verdict.items[2].alt_m) == (RTL, 2)
    assert [(f.field, f.becomes, f.news) for f in verdict.findings] == [("alt_m", 2, News.DANGER)]


def test_a_take_off_without_a_finite_height_is_dropped() -> None:
    assert [held.command for held in verdict_on(item(TAKEOFF, alt_m=NAN), item(WAYPOINT)).items] == [WAYPOINT] * 2


# ---------------------------------------------------------------- frames


FRAMES = (0, 3, 5, 6, 10, 11)


def test_every_height_is_taken_as_relative() -> None:
    for command in (WAYPOINT, UNLIM, TURNS, TIME, RTL, TAKEOFF):
        for frame in FRAMES:
            held, findings = stored(item(command, frame=frame))
            assert held.frame == 3
            assert findings == ({} if frame in (3, 6) else {"frame": (frame, 3)})


def test_the_frame_of_a_height_or_place_that_is_not_used_is_not_a_finding() -> None:
    unused = [(command, frame) for command in (LAND, ROI, SET_ROI) for frame in FRAMES]
    for command, frame in [*unused, (RTL, 2), (LAND, 2), (TAKEOFF, 2)]:
        assert stored(item(command, frame=frame))[1] == {}


def test_a_dropped_item_may_have_any_frame() -> None:
    for frame in (1, 2, 4, 7, 8, 9, 12, 20, 255):
        for dropped in (item(SPEED), item(ROI_NONE), item(WAYPOINT, lat_e7=0), item(TIME, alt_m=NAN)):
            verdict = verdict_on(replace(dropped, frame=frame), item(WAYPOINT))
            assert (verdict.result, len(verdict.items)) == (Result.ACCEPTED, 2)


# ---------------------------------------------------------------- rejected lists


def assert_rejected(verdict: Verdict[WpRecord], ack: MissionResult, seq: int | None, field: str) -> None:
    assert (verdict.result, verdict.ack) == (Result.REJECTED, ack)
    last = verdict.findings[-1]
    assert (last.seq, last.field, last.becomes) == (seq, field, REJECTED)
    assert (verdict.records, verdict.items) == ((), ())


A = MissionResult
LOCATED = (WAYPOINT, UNLIM, TURNS, TIME, ROI, ROI_LOCATION, SET_ROI)
OUT_OF_RANGE = [("lat_e7", 900_000_001, A.INVALID_PARAM5_X), ("lon_e7", 1_800_000_001, A.INVALID_PARAM6_Y)]
#: The list, the number of the item that rejects it, the ack and the field.
REJECTIONS = [
    *((*placed(item(command, frame=2)), A.UNSUPPORTED_FRAME, "frame") for command in LOCATED),
    *(
        (*placed(item(command, frame=frame)), A.UNSUPPORTED_FRAME, "frame")
        for command in (*LOCATED, RTL, LAND, TAKEOFF)
        for frame in (1, 4, 7, 8, 9, 12, 20, 255)
    ),
    *(
        (*placed(item(command, **{field: sign * beyond})), ack, field)
        for command in LOCATED
        for field, beyond, ack in OUT_OF_RANGE
        for sign in (1, -1)
    ),
    # In another place than the first or the last.
    *((mission(item(WAYPOINT), item(command), item(SPEED)), 2, A.INVALID, "command") for command in (UNLIM, LAND)),
    (mission(item(WAYPOINT), item(TAKEOFF), item(WAYPOINT)), 2, A.INVALID, "command"),
    (mission(item(WAYPOINT), item(WAYPOINT), item(TAKEOFF)), 3, A.INVALID, "command"),
    # A region of interest that is the last item, as received or as kept.
    *((mission(item(WAYPOINT), item(roi)), 2, A.INVALID, "command") for roi in (ROI, ROI_LOCATION, SET_ROI)),
    *((mission(item(WAYPOINT), item(roi, lat_e7=0)), 2, A.INVALID, "command") for roi in (ROI, ROI_LOCATION, SET_ROI)),
    *(
        (mission(item(WAYPOINT), item(ROI), dropped), 2, A.INVALID, "command")
        for dropped in (item(SPEED), item(ROI_NONE), item(WAYPOINT, lat_e7=0))
    ),
    # Alone: a region of interest and a dropped item do not count.
    *((mission(item(command)), 1, A.INVALID, "command") for command in (RTL, LAND, TAKEOFF)),
    *((mission(item(ROI), item(command)), 2, A.INVALID, "command") for command in (RTL, LAND)),
    *((mission(item(SPEED), item(command)), 2, A.INVALID, "command") for command in (RTL, LAND)),
    (mission(item(ROI), item(ROI), item(SPEED)), 2, A.INVALID, "command"),
]


def test_a_faulty_item_rejects_the_list() -> None:
    for items, seq, ack, field in REJECTIONS:
        assert_rejected(check_list(items, PROFILE), ack, seq, field)


def test_a_take_off_after_dropped_items_names_the_items_to_remove() -> None:
    verdict = verdict_on(item(SPEED), item(TAKEOFF), item(WAYPOINT))
    assert_rejected(verdict, MissionResult.INVALID, 2, "command")
    why = "TAKEOFF must be item 1: remove WP 1 DO_CHANGE_SPEED, which is not stored"
    assert verdict.findings[-1].text() == f"Rejected, WP 2: {why}"


def test_a_list_without_home_is_reported() -> None:
    verdict = check_list([item(TAKEOFF), item(WAYPOINT)], PROFILE)
    why = "put home first, item 0 is TAKEOFF"
    assert verdict.findings[-1].text() == f"Rejected, Home: {why}"


@pytest.mark.parametrize("command", [WAYPOINT, UNLIM, TURNS, TIME])
def test_other_commands_can_be_alone(command: int) -> None:
    assert verdict_on(item(command)).result is Result.ACCEPTED


def test_two_commands_that_cannot_be_alone_are_accepted_together() -> None:
    assert verdict_on(item(TAKEOFF), item(LAND)).result is Result.ACCEPTED


def test_positions_are_stored_to_the_bit() -> None:
    held, _ = stored(item(WAYPOINT, lat_e7=0x1B0D0D0D, lon_e7=-0x050D0D0D))
    assert (held.lat_e7, held.lon_e7) == (0x1B0D0D0D, -0x050D0D0D)
