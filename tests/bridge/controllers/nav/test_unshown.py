# SPDX-License-Identifier: GPL-3.0-or-later
"""Record fields that no item can show: kept, or their loss is reported."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.mission_item import MissionItem
from protocols.msp.nav import FLY_HOME, LAST, NavRecord
from protocols.msp.nav_items import home_item, items_from_records
from reports.finding import News
from tests.support.nav_lists import LAT, LON, A


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
        (NavRecord(A.WAYPOINT, 0, 0, 3000, flag=FLY_HOME), ""),
        (NavRecord(A.WAYPOINT, LAT, LON, 3000, p3=1), ""),
    ],
)
def test_losses_of_a_changed_leg_are_reported(record: NavRecord, lost: str) -> None:
    held = (NavRecord(A.WAYPOINT, LAT, LON, 2000), record, NavRecord(A.RTH, flag=LAST))
    items = list(items_from_records(held, home_item((LAT, LON))))
    items[2] = replace(items[2], alt_m=40.0)
    verdict = check_list(items, NavRules(NavProfile(), held))
    expected = [(News.WARNING, f"Lost with the old list, as no MAVLink item can show it: {lost}")] if lost else []
    assert [(finding.news, finding.text()) for finding in verdict.findings] == expected
    assert verdict.records[1].alt_cm == 4000
    assert (verdict.records[1].p3 >> 1, verdict.records[1].flag) == (0, 0)


#: User actions in each leg, both altitude datums, and a jump. Items: home, then a speed before each of the legs.
HELD = (
    NavRecord(A.WAYPOINT, LAT, LON, 2000, p3=0b00010),
    NavRecord(A.WAYPOINT, LAT + 900, LON, 15000, p1=500, p3=0b10101),
    NavRecord(A.POSHOLD_TIME, LAT + 1800, LON, 3000, p1=7, p2=400, p3=0b01000),
    NavRecord(A.JUMP, p1=1, p2=1),
    NavRecord(A.LAND, LAT + 2700, LON, 14800, p2=123, p3=0b11111, flag=LAST),
)


def written_again(change: Callable[[list[MissionItem]], list[MissionItem]]) -> tuple[tuple[NavRecord, ...], list[str]]:
    """The records and the messages after HELD was read, changed, and written again."""
    items = change(list(items_from_records(HELD, home_item((LAT, LON)))))
    verdict = check_list(items, NavRules(NavProfile(), HELD))
    return verdict.records, [finding.text() for finding in verdict.findings if finding.news is News.WARNING]


def test_a_list_that_is_read_and_written_again_is_the_same() -> None:
    assert written_again(lambda items: items) == (HELD, [])


@pytest.mark.parametrize("step", [-1, 1])
def test_coordinates_that_a_ground_station_rounds_are_not_changed(step: int) -> None:
    def rounded(items: list[MissionItem]) -> list[MissionItem]:
        return [replace(item, lat_e7=item.lat_e7 and item.lat_e7 + step) for item in items]

    assert written_again(rounded) == (HELD, [])
    further, lost = written_again(lambda items: [*items[:2], replace(items[2], lat_e7=LAT + 2), *items[3:]])
    assert further[0] == NavRecord(A.WAYPOINT, LAT + 2, LON, 2000)
    assert lost == ["Lost with the old list, as no MAVLink item can show it: user actions (1)"]


def test_the_other_legs_keep_them_when_a_leg_is_inserted_or_deleted() -> None:
    new = MissionItem(0, 16, 3, 0, 0, 0, 0, LAT - 900, LON, 20.0)

    def inserted(items: list[MissionItem]) -> list[MissionItem]:
        return [*items[:5], new, *items[5:]]

    records, lost = written_again(inserted)
    assert lost == []
    assert [record.p3 for record in records if record.action != A.JUMP] == [0b10, 0b10101, 0, 0b1000, 0b11111]
    assert records[-1] == HELD[-1]

    def deleted(items: list[MissionItem]) -> list[MissionItem]:
        return [items[0], *items[3:]]

    records, lost = written_again(deleted)
    assert [record.p3 for record in records if record.action != A.JUMP] == [0b10101, 0b1000, 0b11111]
    assert lost == ["Lost with the old list, as no MAVLink item can show it: user actions (1)"]


def test_a_changed_leg_loses_only_its_own_values() -> None:
    def raised(items: list[MissionItem]) -> list[MissionItem]:
        return [*items[:2], replace(items[2], alt_m=30.0), *items[3:]]

    records, lost = written_again(raised)
    assert [record.p3 for record in records] == [0, 0b10101, 0b1000, 0, 0b11111]
    assert lost == ["Lost with the old list, as no MAVLink item can show it: user actions (1)"]
