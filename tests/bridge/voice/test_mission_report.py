# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines sent for a checked list: few, worst first, equal ones joined."""

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.missions.list_check import check_list
from bridge.voice.happening import Severity
from bridge.voice.mission_report import finding_lines, summary
from protocols.mission_item import Command
from tests.support import nav_lists
from tests.support.rule_items import SPEED, WAYPOINT, item, mission

NOTICE, INFO = Severity.NOTICE, Severity.INFO


def test_equal_findings_are_one_line_and_warnings_come_first() -> None:
    items = [item(WAYPOINT, p1=3)] * 4 + [item(SPEED)] * 3 + [item(WAYPOINT, frame=0), item(WAYPOINT, p2=0)]
    verdict = check_list(mission(*items), HarakiriRules())
    assert summary(10, verdict) == "7 of 10 stored: 3 dropped, 1 Alt now relative, 0 m"
    assert [(line.severity, line.text) for line in finding_lines(verdict.findings)] == [
        (NOTICE, "3 items: DO_CHANGE_SPEED dropped, not supported"),
        (NOTICE, "WP 8: Alt flown above home, not above sea level"),
        (INFO, "4 items: Delay changed from 3 to 1 (0 = fly through, 1 = brake; to hold use LOITER_TIME)"),
    ]


def test_at_most_ten_lines_are_sent() -> None:
    verdict = check_list(mission(*(item(WAYPOINT, p1=number) for number in range(2, 40))), HarakiriRules())
    lines = finding_lines(verdict.findings)
    assert len(lines) == 11
    assert lines[-1].text == "and 28 more: see the status page or naze-bridge missions show"


def test_a_landing_that_is_flown_to_first_is_counted() -> None:
    """As Mission Planner sends it, at 0 m."""
    verdict = nav_lists.verdict_on(nav_lists.WP, nav_lists.item(Command.NAV_LAND, alt_m=0.0), nav_lists.jump(1, -5))
    assert summary(4, verdict) == "4 of 4 stored: 1 LAND flown to first, more"
    assert "WP 3: Repeat# changed from -5 to -1 (for ever)" in [line.text for line in finding_lines(verdict.findings)]


def test_a_list_with_every_item_dropped_is_a_warning() -> None:
    assert summary(2, check_list(mission(item(SPEED)), HarakiriRules())) == "Mission erased: no command left"
