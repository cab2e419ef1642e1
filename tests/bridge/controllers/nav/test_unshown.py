# SPDX-License-Identifier: GPL-3.0-or-later
"""Record fields that no item can show: kept, or their loss is reported."""

from dataclasses import replace

import pytest

from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.items import home_item, items_from_records
from bridge.controllers.nav.rules import inav_profile
from bridge.missions.list_check import check_list
from protocols.msp.nav import FLY_HOME, LAST, NavRecord
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
    verdict = check_list(items, NavRules(inav_profile(), held))
    expected = [(News.WARNING, f"Lost with the old list, as no MAVLink item can show it: {lost}")] if lost else []
    assert [(finding.news, finding.text()) for finding in verdict.findings] == expected
    assert verdict.records[1].alt_cm == 4000
    assert (verdict.records[1].p3 >> 1, verdict.records[1].flag) == (0, 0)


@pytest.mark.parametrize(("p3", "copy"), [(0, "a copy"), (2, "a copy without its user actions (2)")])
def test_losses_in_the_copy_of_an_erased_mission_are_reported(p3: int, copy: str) -> None:
    leg = NavRecord(A.WAYPOINT, LAT, LON, 2000, p3=p3)
    other = (leg, replace(leg, flag=LAST))
    home, *legs = items_from_records([NavRecord(A.WAYPOINT, LAT, LON, 3000)] * 119, home_item((LAT, LON)))
    (finding,) = check_list([home, *legs], NavRules(inav_profile(), others=(other,))).findings
    assert finding.text() == f"Mission of 2 records does not fit next to it: erased, {copy} is kept on the Pi"
