# SPDX-License-Identifier: GPL-3.0-or-later
"""Any list of another planner that is read and written again: the same records, or every change is reported."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.controllers.multiwii import multiwii_profile
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.msp.nav import FLY_HOME, LAST, NavAction, NavRecord
from protocols.msp.nav_items import home_item, items_from_records
from reports.finding import News
from reports.verdict import Result

FIELD = st.integers(-0x8000, 0x7FFF) | st.integers(-1, 5)
RECORDS = st.builds(
    NavRecord,
    # INAV stores no POSHOLD_UNLIM.
    action=st.sampled_from([action.value for action in NavAction if action is not NavAction.POSHOLD_UNLIM]),
    lat_e7=st.sampled_from([0, 453838000, 453848000]),
    lon_e7=st.sampled_from([0, 84733000]),
    alt_cm=st.integers(-10_000, 3_276_700) | st.just(2000),
    p1=FIELD,
    p2=FIELD,
    p3=FIELD,
    flag=st.sampled_from([0, FLY_HOME]),
)


@pytest.mark.parametrize("profile", [NavProfile(), multiwii_profile()], ids=["inav", "multiwii"])
@given(records=st.lists(RECORDS, min_size=1, max_size=4))
def test_a_list_that_is_written_again_is_the_same_or_the_changes_are_reported(
    profile: NavProfile, records: list[NavRecord]
) -> None:
    former = (*records[:-1], replace(records[-1], flag=LAST))
    verdict = check_list(items_from_records(former, home_item(None)), NavRules(profile, former))
    if verdict.result is Result.ACCEPTED and verdict.records != former:
        assert any(finding.news is not News.NONE for finding in verdict.findings)


@pytest.mark.parametrize(
    "record",
    [
        NavRecord(NavAction.WAYPOINT, 453838000, 84733000, 2000, p1=49, p2=3, p3=0b10),
        NavRecord(NavAction.POSHOLD_TIME, 453838000, 84733000, 2000, p1=7, p2=-1),
        NavRecord(NavAction.SET_POI, 453838000, 84733000, 2000, p1=3, p2=4),
        NavRecord(NavAction.SET_HEAD, 1, 2, 3, p1=-7, p2=5, p3=6),
        NavRecord(NavAction.LAND, 453838000, 84733000, 2000, p2=120),
    ],
)
def test_values_that_no_item_shows_are_kept(record: NavRecord) -> None:
    former = (
        NavRecord(NavAction.WAYPOINT, 453838000, 84733000, 2000),
        record,
        NavRecord(NavAction.RTH, 1, 2, 0, p1=7, p2=9, flag=LAST),
    )
    verdict = check_list(items_from_records(former, home_item(None)), NavRules(NavProfile(), former))
    assert verdict.records == former
    assert verdict.findings == ()
