# SPDX-License-Identifier: GPL-3.0-or-later
"""Speeds: stored in the legs, shown as items."""

from dataclasses import replace

from reports.finding import DROPPED
from tests.support.nav_lists import WP, C, findings_for, item, kept, speed, verdict_on


def test_speeds_are_stored_in_the_legs_and_shown_as_items() -> None:
    sent = (WP, speed(7.5), WP, item(C.NAV_LOITER_TIME, p1=5), item(C.DO_SET_ROI), speed(3), item(C.NAV_LAND))
    records = kept(*sent)
    assert [(r.action, r.p1, r.p2) for r in records] == [(1, 0, 0), (1, 750, 0), (3, 5, 750), (5, 0, 0), (8, 300, 0)]
    verdict = verdict_on(*sent)
    assert verdict.findings == ()
    assert list(verdict.items[1:]) == [replace(it, seq=n) for n, it in enumerate(sent, 1)]


def test_a_speed_can_return_to_the_default() -> None:
    sent = (speed(7), WP, speed(-2), WP)
    assert [record.p1 for record in kept(*sent)] == [700, 0]
    assert [shown.p2 for shown in verdict_on(*sent).items if shown.command == C.DO_CHANGE_SPEED] == [7, -2]


def test_lost_parts_of_a_speed_are_reported() -> None:
    assert findings_for(speed(0.1, 0, 50), WP) == [(1, "p2", 0.1, 0.5)]
    assert findings_for(WP, speed(5), item(C.NAV_RETURN_TO_LAUNCH, at=False)) == [(2, "command", 178, DROPPED)]
    assert findings_for(speed(1e30), WP) == [(1, "p2", 1e30, 327.67)]
