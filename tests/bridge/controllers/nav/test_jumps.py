# SPDX-License-Identifier: GPL-3.0-or-later
"""Jumps in lists for INAV and MultiWii NAV: their targets, and those that cannot be flown."""

import math

import pytest

from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.nav import NavRecord
from reports.finding import REJECTED
from reports.verdict import Result
from tests.support.nav_lists import (
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


def test_a_jump_target_is_renumbered_for_the_flight_controller() -> None:
    sent = (WP, speed(5), WP, item(C.NAV_TAKEOFF, at=False, alt_m=5.0), WP, jump(3), WP)
    records = kept(*sent)
    assert records[3] == NavRecord(A.JUMP, p1=2, p2=2)
    verdict = verdict_on(*sent)
    assert [shown.p1 for shown in verdict.items if shown.command == C.DO_JUMP] == [3]


def test_a_jump_to_a_merged_or_dropped_item_goes_to_the_next() -> None:
    assert kept(WP, speed(5), WP, WP, jump(2, -1))[3] == NavRecord(A.JUMP, p1=2, p2=-1, flag=0xA5)
    takeoff = item(C.NAV_TAKEOFF, at=False, alt_m=5.0)
    assert kept(takeoff, WP, WP, jump(1))[2].p1 == 1
    assert findings_for(takeoff, WP, WP, jump(1))[-1] == (4, "p1", 1, 2)


def test_a_jump_may_go_forward_on_inav_and_only_back_on_multiwii() -> None:
    forward = (WP, jump(4), WP, WP)
    assert kept(*forward)[1].p1 == 4
    assert verdict_on(*forward, rules=MULTIWII).ack is MissionResult.INVALID_PARAM1
    assert kept(WP, jump(1), rules=MULTIWII)[1].p1 == 1


@pytest.mark.parametrize(
    "items",
    [
        (WP, WP, jump(0)),
        (WP, WP, jump(-1)),
        (WP, WP, jump(4)),
        (WP, WP, jump(math.nan)),
        (WP, WP, jump(1.5)),
        (WP, WP, jump(1e30)),
        (WP, WP, jump(2)),
        (WP, WP, jump(3)),
        (WP, jump(3), WP),
        (jump(3), WP, WP),
        (item(C.DO_SET_ROI), WP, WP, jump(1)),
        (WP, item(C.NAV_RETURN_TO_LAUNCH, at=False), WP, WP, jump(2)),
        (WP, WP, jump(4), item(206)),
    ],
)
def test_a_jump_that_blocks_arming_or_crashes_inav_rejects_the_list(items: tuple[MissionItem, ...]) -> None:
    verdict = verdict_on(*items)
    assert (verdict.result, verdict.ack) == (Result.REJECTED, MissionResult.INVALID_PARAM1)
    assert verdict.findings[-1].becomes == REJECTED


def test_a_jump_to_the_first_record_as_the_last_means_hover() -> None:
    """INAV stores the target as an index, 0."""
    assert verdict_on(WP, jump(5), WP, RTL, WP, WP, jump(1)).result is Result.ACCEPTED
    assert verdict_on(WP, jump(5), WP, RTL_LANDS, WP, WP, jump(1)).result is Result.REJECTED
    assert verdict_on(WP, jump(5), WP, RTL_LANDS, WP, WP, WP, jump(5)).result is Result.ACCEPTED


def test_only_nested_jumps_are_rejected_on_multiwii() -> None:
    assert verdict_on(WP, WP, jump(1), WP, jump(1), rules=MULTIWII).ack is MissionResult.INVALID_PARAM1
    assert len(kept(WP, WP, jump(1), WP, WP, jump(4), rules=MULTIWII)) == 6
    assert len(kept(WP, WP, WP, jump(1), WP, WP, jump(1))) == 7
