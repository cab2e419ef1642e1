# SPDX-License-Identifier: GPL-3.0-or-later
"""The limits of each firmware: capacity, holds, heights, endings."""

from dataclasses import replace

import pytest

from bridge.controllers.nav.check import NavRules
from bridge.missions.list_check import check_count
from protocols.mission_item import MissionItem, MissionResult
from reports.finding import DROPPED, News
from reports.verdict import Result
from tests.support.nav_lists import (
    INAV,
    MULTIWII,
    RTL,
    RTL_LANDS,
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


def test_the_capacity_comes_from_the_flight_controller() -> None:
    assert len(kept(*(WP,) * 120)) == 120
    assert len(kept(*(speed(5), WP, speed(6), WP) * 60)) == 120
    assert check_count(242, INAV) is not None
    assert check_count(180, MULTIWII) is not None


def test_multiwii_has_an_endless_hold_an_rtl_height_and_no_speeds() -> None:
    sent = (WP, item(C.NAV_LOITER_UNLIM), item(C.NAV_RETURN_TO_LAUNCH, at=False, alt_m=30.0))
    verdict = verdict_on(*sent, rules=MULTIWII)
    assert verdict.findings == ()
    assert [(r.action, r.alt_cm) for r in verdict.records] == [(1, 5000), (2, 5000), (4, 3000)]
    assert list(verdict.items[1:]) == [replace(it, seq=n) for n, it in enumerate(sent, 1)]
    assert findings_for(speed(5), WP, rules=MULTIWII) == [(1, "command", 178, DROPPED)]
    assert findings_for(replace(WP, frame=0), rules=MULTIWII) == [(1, "frame", 0, 3)]


@pytest.mark.parametrize("rules", [INAV, MULTIWII])
def test_items_after_an_rtl_are_dropped(rules: NavRules) -> None:
    assert [r.action for r in kept(WP, WP, RTL_LANDS, WP, WP, rules=rules)] == [1, 1, 4]
    assert findings_for(WP, RTL, WP, WP, rules=rules) == [(3, "command", 16, DROPPED), (4, "command", 16, DROPPED)]
    # Unless a jump leads there.
    over = (WP, WP, WP, jump(1), WP) if rules is MULTIWII else (WP, jump(4), RTL, WP, WP)
    assert findings_for(*over, rules=rules) == []


def test_an_rtl_whose_ending_the_last_item_would_change_is_rejected_on_inav() -> None:
    over = (WP, jump(5), WP, RTL_LANDS, WP, WP)
    assert verdict_on(*over).ack is MissionResult.INVALID_PARAM1
    assert [r.p1 for r in kept(*(RTL if it is RTL_LANDS else it for it in over)) if r.action == A.RTH] == [0]
    assert verdict_on(*over[:-2], speed(5), WP, WP).result is Result.ACCEPTED


@pytest.mark.parametrize(
    "last", [item(C.NAV_ROI), item(C.DO_SET_ROI_NONE, at=False), item(C.CONDITION_YAW, at=False, p1=90)]
)
def test_trailing_turns_are_dropped_on_multiwii(last: MissionItem) -> None:
    assert kept(WP, WP, last, rules=MULTIWII) == kept(WP, WP, rules=MULTIWII)
    assert [(f.seq, f.becomes, f.news) for f in verdict_on(WP, WP, last, rules=MULTIWII).findings] == [
        (3, DROPPED, News.WARNING)
    ]
    assert len(kept(WP, WP, last)) == 3


@pytest.mark.parametrize(("seconds", "held"), [(65, 65), (66, 65), (70000, 65)])
def test_multiwii_holds_at_most_65_s(seconds: float, held: int) -> None:
    for sent in (item(C.NAV_LOITER_TIME, p1=seconds), replace(WP, p1=seconds)):
        verdict = verdict_on(WP, sent, WP, rules=MULTIWII)
        assert verdict.records[1].p1 == held
        assert [f.news for f in verdict.findings] == ([] if seconds == held else [News.WARNING])
