# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules for INAV and MultiWii NAV: docs/inav.md, row by row, and properties of every list."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import event, example, given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.mavlink.codec import item_from_float_message
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.nav import ENDLESS_S, FLY_HOME, LAST, LEGS, NavAction, NavRecord, decode_wp, encode_set_wp
from protocols.msp.nav_items import home_item, items_from_records
from reports.finding import DROPPED, News
from reports.verdict import Result
from tests.bridge.controllers.harakiri.test_rules import degrees, numbers
from tests.support.nav_lists import (
    HOME,
    INAV,
    LAT,
    LON,
    MULTIWII,
    RTL,
    WP,
    A,
    C,
    findings_for,
    item,
    jump,
    kept,
    speed,
    verdict_on,
)


@pytest.mark.parametrize(
    ("sent", "record"),
    [
        (WP, NavRecord(A.WAYPOINT, LAT, LON, 5000)),
        (replace(WP, frame=0), NavRecord(A.WAYPOINT, LAT, LON, 5000, p3=1)),
        (replace(WP, frame=5), NavRecord(A.WAYPOINT, LAT, LON, 5000, p3=1)),
        (replace(WP, frame=6), NavRecord(A.WAYPOINT, LAT, LON, 5000)),
        (replace(WP, p1=7), NavRecord(A.POSHOLD_TIME, LAT, LON, 5000, 7)),
        (item(C.NAV_LOITER_TIME, p1=32766), NavRecord(A.POSHOLD_TIME, LAT, LON, 5000, 32766)),
        (item(C.NAV_LOITER_UNLIM), NavRecord(A.POSHOLD_TIME, LAT, LON, 5000, ENDLESS_S)),
        (item(C.NAV_LAND), NavRecord(A.LAND, LAT, LON, 5000)),
        (item(C.NAV_ROI), NavRecord(A.SET_POI, LAT, LON, 5000)),
        (item(C.DO_SET_ROI, frame=0), NavRecord(A.SET_POI, LAT, LON, 5000, p3=1)),
        (item(C.DO_SET_ROI_LOCATION), NavRecord(A.SET_POI, LAT, LON, 5000)),
        (item(C.DO_SET_ROI_NONE, at=False), NavRecord(A.SET_HEAD, p1=-1)),
        (item(C.CONDITION_YAW, at=False, p1=270), NavRecord(A.SET_HEAD, p1=270)),
    ],
)
def test_supported_items_are_stored_and_read_back_unchanged(sent: MissionItem, record: NavRecord) -> None:
    verdict = verdict_on(WP, sent, WP)
    assert verdict.findings == ()
    assert verdict.records[1] == record
    shown_frame = {5: 0, 6: 3}.get(sent.frame, sent.frame)
    assert verdict.items[2] == replace(sent, seq=2, frame=shown_frame)


@pytest.mark.parametrize(
    ("sent", "record", "findings"),
    [
        (item(C.NAV_LOITER_TURNS, p1=3), A.WAYPOINT, [("p1", 3, 0), ("command", 18, 16)]),
        (replace(WP, p1=0.5, p2=2, p4=90), A.WAYPOINT, [("p1", 0.5, 0), ("p2", 2, 0), ("p4", 90, 0)]),
        (item(C.NAV_LOITER_TIME, p1=40000), A.POSHOLD_TIME, [("p1", 40000, 32766)]),
        (replace(WP, frame=10), A.WAYPOINT, [("frame", 10, 3)]),
        (replace(WP, alt_m=50.123), A.WAYPOINT, [("alt_m", 50.123, 50.12)]),
        (replace(WP, alt_m=1e30), A.WAYPOINT, [("alt_m", 1e30, 32767), ("alt_m", 1e30, 1e30)]),
        (item(C.CONDITION_YAW, at=False, p1=360, p3=-1), A.SET_HEAD, [("p1", 360, 0), ("p3", -1, 0)]),
        (item(C.CONDITION_YAW, at=False, p1=-90), A.SET_HEAD, [("p1", -90, 270)]),
        (replace(WP, alt_m=-12.34), A.WAYPOINT, [("alt_m", -12.34, -12.34)]),
        (replace(WP, alt_m=0.0), A.WAYPOINT, [("alt_m", 0, 2)]),
        (replace(WP, alt_m=0.0, frame=0), A.WAYPOINT, [("alt_m", 0, 0)]),
        (item(C.NAV_LAND, alt_m=0.0), A.LAND, [("alt_m", 0, 50)]),
        (item(C.NAV_LAND, at=False), A.LAND, [("lat_e7", 0, LAT), ("lon_e7", 0, LON), ("alt_m", 0, 50)]),
    ],
)  # fmt: skip
def test_unsupported_values_are_reported(sent: MissionItem, record: NavAction, findings: list[tuple[Any, ...]]) -> None:
    assert kept(WP, sent, WP)[1].action == record
    assert [finding[1:] for finding in findings_for(WP, sent, WP)] == findings


@pytest.mark.parametrize(
    "sent",
    [
        item(C.NAV_TAKEOFF, at=False, alt_m=10),
        item(206),
        item(C.NAV_WAYPOINT, lat_e7=0),
        item(C.NAV_WAYPOINT, alt_m=math.nan),
        item(C.CONDITION_YAW, at=False, p1=20, p4=1),
        item(C.CONDITION_YAW, at=False, p1=math.nan),
        speed(5, kind=2),
        speed(-1),
        speed(0),
        speed(math.nan),
    ],
)
def test_unsupported_commands_are_dropped(sent: MissionItem) -> None:
    assert kept(WP, sent, WP) == kept(WP, WP)
    assert [(finding[0], finding[3]) for finding in findings_for(WP, sent, WP)] == [(2, DROPPED)]


def test_a_landing_without_a_position_after_rtl_is_merged_into_it() -> None:
    rtl, land = item(C.NAV_RETURN_TO_LAUNCH, at=False), item(C.NAV_LAND, at=False)
    assert kept(WP, rtl, land)[1:] == (NavRecord(A.RTH, p1=1, flag=0xA5),)
    assert findings_for(WP, rtl, land) == [(3, "command", 21, DROPPED)]


@pytest.mark.parametrize(
    ("items", "ack"),
    [
        ((item(C.NAV_RETURN_TO_LAUNCH, at=False),), MissionResult.INVALID),
        ((item(C.NAV_TAKEOFF, at=False, alt_m=5.0), item(206)), MissionResult.INVALID),
        ((item(C.DO_SET_ROI), item(C.DO_SET_ROI_NONE, at=False)), MissionResult.INVALID),
        ((item(C.NAV_WAYPOINT, frame=7),), MissionResult.UNSUPPORTED_FRAME),
        ((item(C.NAV_WAYPOINT, lat_e7=900_000_001),), MissionResult.INVALID_PARAM5_X),
        ((item(C.NAV_WAYPOINT, lon_e7=2**31 - 1),), MissionResult.INVALID_PARAM6_Y),
        ((WP,) * 121, MissionResult.NO_SPACE),
        ((WP,) * 300, MissionResult.NO_SPACE),
    ],
)
def test_a_list_that_cannot_be_flown_is_rejected(items: tuple[MissionItem, ...], ack: MissionResult) -> None:
    verdict = verdict_on(*items)
    assert (verdict.result, verdict.ack, verdict.records) == (Result.REJECTED, ack, ())


def test_home_is_not_a_record() -> None:
    for lat in (0, None, LAT, 2**31 - 1):
        verdict = check_list([replace(HOME, lat_e7=lat), WP], INAV, (LAT + 11, LON + 22))
        assert (verdict.result, len(verdict.records), verdict.findings) == (Result.ACCEPTED, 1, ())
        assert verdict.items[0].lat_e7 == (LAT if lat == LAT else LAT + 11)
    assert check_list([WP, WP], INAV).result is Result.ACCEPTED
    assert check_list([item(C.NAV_LAND), WP], INAV).ack is MissionResult.INVALID


# -- flown differently than it reads ---------------------------------------------------------------------------


def test_an_rtl_as_the_first_item_is_rejected() -> None:
    assert verdict_on(RTL, WP, WP).ack is MissionResult.INVALID


def test_only_a_multiwii_flies_home_at_the_height_of_an_rtl() -> None:
    at_20_m = replace(RTL, alt_m=20.0)
    assert findings_for(WP, at_20_m) == [(2, "alt_m", 20, 0)]
    assert findings_for(WP, at_20_m, rules=MULTIWII) == []
    assert [kept(WP, at_20_m, rules=rules)[1].alt_cm for rules in (INAV, MULTIWII)] == [0, 2000]


def test_an_unused_height_may_have_any_value() -> None:
    for unused in (item(C.NAV_ROI, alt_m=math.nan), replace(RTL, alt_m=math.nan)):
        assert len(kept(WP, unused, *((WP,) if unused.command == C.NAV_ROI else ()))) >= 2
        assert findings_for(WP, WP, unused) == []
    assert kept(WP, replace(RTL, alt_m=math.nan), rules=MULTIWII)[1].alt_cm == 0


def test_unused_fields_are_reported_only_if_something_is_lost() -> None:
    def news(sent: MissionItem) -> list[News]:
        return [finding.news for finding in verdict_on(WP, sent, WP).findings]

    assert [finding.news for finding in verdict_on(WP, WP, replace(jump(1), p3=3.0)).findings] == [News.NONE]
    assert news(item(C.DO_SET_ROI_NONE)) == [News.NONE] * 3
    assert news(item(C.DO_CHANGE_SPEED, p1=1.0, p2=0.0, at=False)) == [News.NONE]
    assert news(item(C.NAV_ROI, p2=1.0, p4=2.0)) == [News.NONE] * 2
    assert [f.news for f in verdict_on(WP, item(C.NAV_RETURN_TO_LAUNCH, p3=1.0, alt_m=0.0)).findings] == [News.NONE] * 3
    assert news(replace(WP, p2=2.0)) == [News.NOTICE]
    assert news(item(C.NAV_LOITER_TURNS, p1=3)) == [News.NOTICE, News.WARNING]


ALL = [16, 16, 16, 17, 18, 19, 20, 21, 22, 80, 115, 177, 177, 178, 178, 195, 197, 201, 206]
tame = st.sampled_from([-2.0, -1.0, 0.0, 0.3, 1.0, 2.0, 3.0, 4.0, 5.5, 180.0, 359.0, math.nan])
items = st.builds(
    MissionItem,
    seq=st.just(0),
    command=st.sampled_from(ALL),
    frame=st.sampled_from([0, 2, 3, 3, 3, 5, 6, 10]),
    p1=st.one_of(tame, tame, numbers),
    p2=st.one_of(tame, tame, numbers),
    p3=st.sampled_from([0.0, math.nan, 3.0]),
    p4=st.sampled_from([0.0, 0.0, 1.0, math.nan]),
    lat_e7=st.one_of(st.sampled_from([453838000, 453840141, -1, 0]), degrees),
    lon_e7=st.one_of(st.sampled_from([84733000, 84741389, -1, None]), degrees),
    alt_m=st.one_of(st.sampled_from([50.0, 33.33, 0.0]), numbers),
)
flyable = st.builds(
    replace,
    items,
    command=st.sampled_from([c for c in ALL if c != 177] * 2 + [177]),
    frame=st.sampled_from([0, 3, 10]),
    lat_e7=st.sampled_from([453838000, 453840141]),
    lon_e7=st.sampled_from([84733000, -1]),
    alt_m=st.sampled_from([50.0, 33.33, 0.0]),
)
lists = st.one_of(st.lists(flyable, min_size=1, max_size=14), st.lists(items, min_size=1, max_size=6))
profiles = st.sampled_from([INAV, MULTIWII])


@given(lists, profiles)
@example([item(C.NAV_WAYPOINT), item(C.NAV_LAND, alt_m=1e307)], INAV)
def test_any_list_is_judged_without_an_error_or_a_dangerous_record(sent: list[MissionItem], rules: NavRules) -> None:
    verdict = check_list([HOME, *sent], rules)
    event(verdict.result.name)
    assert all("\n" not in finding.text() for finding in verdict.findings)
    if verdict.result is not Result.ACCEPTED:
        assert verdict.records == ()
        return
    assert [record.flag for record in verdict.records] == [0] * (len(verdict.records) - 1) + [0xA5]
    for number, record in enumerate(verdict.records, 1):
        assert decode_wp(encode_set_wp(number, record)[5:-1]) == (number, record)
        if record.action == A.JUMP:
            assert 1 <= record.p1 <= len(verdict.records)
            assert verdict.records[record.p1 - 1].action in LEGS
            assert rules is MULTIWII or abs(record.p1 - number) >= 2
            assert rules is INAV or record.p1 < number
        if record.action == A.POSHOLD_UNLIM:
            assert rules is MULTIWII


@given(lists, profiles, st.booleans(), st.booleans())
def test_a_list_that_was_read_is_written_back_unchanged(
    sent: list[MissionItem], rules: NavRules, remembered: bool, as_float: bool
) -> None:
    verdict = check_list([HOME, *sent], rules)
    if verdict.result is not Result.ACCEPTED:
        return
    read = items_from_records(verdict.records, verdict.items[0], verdict.sent_as if remembered else {})
    if remembered:
        assert read == verdict.items
    if as_float:
        # As sent: heights and parameters in single precision, positions in degrees * 1e7.
        read = tuple(through_the_wire(shown) for shown in read)
    again = check_list(read, rules)
    assert again.result is Result.ACCEPTED
    # Dangerous items are reported every time.
    assert [finding for finding in again.findings if finding.was != finding.becomes] == []
    assert again.records == verdict.records
    if remembered and not as_float:
        assert again.items == verdict.items


def through_the_wire(shown: MissionItem) -> MissionItem:
    params = (shown.p1, shown.p2, shown.p3, shown.p4)
    link = messages.MAVLink(None, 1, 1)
    packed = messages.MAVLink_mission_item_message(
        1, 1, shown.seq, shown.frame, shown.command, 0, 1, *params, 0, 0, shown.alt_m
    ).pack(link)
    decoded = item_from_float_message(link.parse_char(packed))
    return replace(decoded, lat_e7=shown.lat_e7, lon_e7=shown.lon_e7)


@given(st.lists(flyable, min_size=1, max_size=10))
def test_every_difference_is_reported(sent: list[MissionItem]) -> None:
    """Without findings every item reads back as sent, except NaN, equivalent frames, and where speed items are."""
    verdict = check_list([HOME, *sent], INAV)
    if verdict.result is not Result.ACCEPTED or verdict.findings:
        return
    event("without findings")
    frames = {5: 0, 6: 3, 2: 3}

    def comparable(shown: MissionItem) -> tuple[Any, ...]:
        params = tuple(0.0 if math.isnan(p) else p for p in (shown.p1, shown.p2, shown.p3, shown.p4))
        is_leg = shown.command in (16, 17, 19, 21, 80, 195, 201)
        frame = frames.get(shown.frame, shown.frame) if is_leg else None
        return shown.command, frame, *params, shown.lat_e7 or 0, shown.lon_e7 or 0, shown.alt_m

    def without_speeds(of: Any) -> list[tuple[Any, ...]]:
        return [comparable(shown)[:1] + comparable(shown)[3:] for shown in of if shown.command not in (177, 178)]

    assert without_speeds(verdict.items[1:]) == without_speeds(sent)


speeds = st.sampled_from([0, 50, 500])
heights = st.integers(100, 20_000)
places = {"lat_e7": st.integers(LAT, LAT + 9000), "lon_e7": st.integers(LON, LON + 9000), "alt_cm": heights}
p3s = st.integers(0, 1)
foreign_legs = st.one_of(
    st.builds(NavRecord, st.just(A.WAYPOINT), **places, p1=speeds, p3=p3s),
    st.builds(NavRecord, st.just(A.POSHOLD_TIME), **places, p1=st.integers(0, 900), p2=speeds, p3=p3s),
    st.builds(NavRecord, st.just(A.LAND), **places, p1=speeds, p3=p3s),
)
foreign_turns = st.one_of(
    st.builds(NavRecord, st.just(A.SET_POI), **places),
    st.builds(NavRecord, st.just(A.SET_HEAD), p1=st.integers(-1, 359)),
)


@given(st.lists(st.one_of(foreign_legs, foreign_turns), max_size=8), foreign_legs)
def test_another_planners_list_is_written_back_unchanged(before: list[NavRecord], last: NavRecord) -> None:
    held = (*before, replace(last, flag=0xA5))
    again = check_list(items_from_records(held, home_item((LAT, LON))), NavRules(NavProfile(), held))
    changes = [finding for finding in again.findings if finding.was != finding.becomes]
    assert (again.result, changes, again.records) == (Result.ACCEPTED, [], held)


def test_any_record_of_another_planner_is_shown() -> None:
    records = [
        NavRecord(99, 1, 2, 3),
        NavRecord(A.JUMP, p1=77),
        NavRecord(A.WAYPOINT, p1=-5),
        NavRecord(A.SET_HEAD, p1=400),
    ]
    shown = items_from_records(records, home_item(None))
    assert [(it.command, it.p1) for it in shown] == [(16, 0), (0, 99), (177, 0), (16, 0), (197, 0)]


@pytest.mark.parametrize(
    ("record", "lost"),
    [
        (NavRecord(A.WAYPOINT, LAT, LON, 3000, p3=2), "user actions (1)"),
        (NavRecord(A.WAYPOINT, LAT, LON, 3000, flag=FLY_HOME), "fly home (1)"),
        (NavRecord(A.LAND, LAT, LON, 3000, p2=120, p3=1), "ground elevation (1)"),
        (NavRecord(A.WAYPOINT, LAT, LON, 3000, p3=1), ""),
    ],
)
def test_values_that_items_cannot_show_are_lost_with_a_warning(record: NavRecord, lost: str) -> None:
    held = (NavRecord(A.WAYPOINT, LAT, LON, 2000), record, NavRecord(A.RTH, flag=LAST))
    items = list(items_from_records(held, home_item((LAT, LON))))
    verdict = check_list(items, NavRules(NavProfile(), held))
    expected = [(News.WARNING, f"Lost with the old list, because MAVLink items cannot show it: {lost}")] if lost else []
    assert [(finding.news, finding.text()) for finding in verdict.findings] == expected
