# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts for the pilot."""

import math
from dataclasses import replace

import pytest

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from bridge.voice.mission_report import finding_lines, summary
from reports.finding import DROPPED, REJECTED, Finding, News
from tests.support.rule_items import (
    HOME,
    LAND,
    LON,
    ROI,
    ROI_LOCATION,
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


@pytest.mark.parametrize(
    ("finding", "text"),
    [
        (
            Finding(3, "alt_m", 0.0, 2, "0 not allowed", WAYPOINT, News.WARNING),
            "WP 3: Alt raised from 0 to 2 m (0 not allowed)",
        ),
        (Finding(3, "p2", None, 2, "2..255", WAYPOINT), "WP 3: Hit Rad set to 2 m (2..255)"),
        (Finding(3, "p2", 3.25, 3, "whole", WAYPOINT), "WP 3: Hit Rad changed from 3.25 to 3 m (whole)"),
        (Finding(0, "p1", 7.0, 1, "1 = brake", WAYPOINT), "Home: Delay changed from 7 to 1 (1 = brake)"),
        (Finding(4, "p1", 300.0, 255, "seconds 1..255", TIME), "WP 4: Time s changed from 300 to 255 (seconds 1..255)"),
        (Finding(12, "lat_e7", 453838000, 0, "not used", LAND), "WP 12: Lat changed from 45.3838000 to 0 (not used)"),
        (Finding(12, "p1", 1.5, 0, "not used", LAND), "WP 12: param1 changed from 1.5 to 0 (not used)"),
        (Finding(4, "command", 178, DROPPED, "not supported", SPEED), "WP 4: DO_CHANGE_SPEED dropped, not supported"),
        (
            Finding(None, "count", 147, "rejected", "147 items, but only 146 fit"),
            "Mission rejected: 147 items, but only 146 fit",
        ),
        (Finding(1, "p1", math.inf, 0, "not used", RTL), "WP 1: param1 changed from inf to 0 (not used)"),
        # As stored by an older release.
        (
            Finding(4, "command", 178, DROPPED, "command 178 is not supported"),
            "WP 4: item dropped, command 178 is not supported",
        ),
    ],
)
def test_each_finding_has_a_text(finding: Finding, text: str) -> None:
    assert finding.text() == text


def test_every_warning_and_rejection_fits_a_statustext() -> None:
    """With three-digit item numbers; of a longer text Mission Planner's HUD shows only the last piece."""
    before = [item(WAYPOINT)] * 98
    texts = []
    for tail in (
        [item(WAYPOINT, alt_m=0.5, frame=10), item(WAYPOINT, alt_m=0, frame=0), item(RTL, alt_m=math.nan)],
        [item(SPEED), item(ROI_LOCATION, lat_e7=0), item(WAYPOINT, alt_m=math.nan), item(WAYPOINT)],
        [item(WAYPOINT, frame=255)],
        [item(WAYPOINT, lat_e7=900000001)],
        [item(WAYPOINT, lon_e7=1800000001)],
        [item(UNLIM), item(WAYPOINT)],
        [item(TAKEOFF), item(WAYPOINT)],
        [item(WAYPOINT), item(SET_ROI)],
        [item(ROI), item(SPEED)],
        [item(WAYPOINT, alt_m=-0.5)],
    ):
        verdict = check_list(mission(*before, *tail), HarakiriRules())
        texts += [each.text() for each in verdict.findings if each.news is News.WARNING or each.becomes == REJECTED]
    for command in (RTL, LAND, TAKEOFF):
        texts += [each.text() for each in check_list(mission(item(command)), HarakiriRules()).findings]
    assert len(texts) > 15
    assert [text for text in texts if len(text) > 50] == []


def test_no_value_is_reported_as_changed_to_itself() -> None:
    """Neither a number with noise in its last digit nor an unchanged coordinate."""
    verdict = check_list(mission(item(WAYPOINT, p1=math.inf, p2=3.0000002384185791, p3=0.5)), HarakiriRules())
    assert [each.text() for each in verdict.findings] == [
        "WP 1: Delay changed from inf to 0 (not a number)",
        "WP 1: Hit Rad changed from 3.00000024 to 3 m (whole numbers only)",
        "WP 1: param3 changed from 0.5 to 0 (not used)",
    ]
    home = replace(HOME, lon_e7=0)
    verdict = check_list([home, item(WAYPOINT)], HarakiriRules(), (home.lat_e7 or 0, LON + 5))
    assert [each.text() for each in verdict.findings] == ["Home: no Lat/Long sent, GPS position used"]


def test_a_filled_in_default_is_not_reported() -> None:
    """Mission Planner sends no radius for home, and 0 for an empty field."""
    verdict = check_list([replace(HOME, p2=0.0), item(WAYPOINT, p2=0.0), item(TIME, p2=math.nan)], HarakiriRules())
    assert {each.news for each in verdict.findings} == {News.NONE}
    assert summary(3, verdict) == "3 of 3 stored: 0 m, highest 10 m, does not land"
    assert finding_lines(verdict.findings) == []


def test_a_list_without_home_reports_the_first_item_as_home() -> None:
    """As sent by MAVSDK's `mission` plugin."""
    verdict = check_list([item(WAYPOINT, frame=6), item(WAYPOINT)], HarakiriRules())
    assert [each.text() for each in verdict.findings] == ["Home: item 0 became home, not flown to"]
    assert summary(2, verdict) == "2 of 2 stored: check home, 0 m, no landing"


def test_a_leg_below_home_is_not_counted_as_raised() -> None:
    verdict = check_list(mission(item(WAYPOINT, alt_m=-5.0), item(WAYPOINT, alt_m=0.0)), NavRules(NavProfile()))
    assert summary(3, verdict) == "3 of 3 stored: 1 Alt raised, 1 flown differently"


def test_an_altitude_below_one_metre_is_raised_with_that_reason() -> None:
    verdict = check_list(mission(item(WAYPOINT, alt_m=0.5), item(WAYPOINT, alt_m=0.0)), HarakiriRules())
    assert [line.text for line in finding_lines(verdict.findings)] == [
        "WP 1: Alt raised from 0.5 to 2 m (less than 1)",
        "WP 2: Alt raised from 0 to 2 m (0 not allowed)",
    ]
    assert summary(3, verdict) == "3 of 3 stored: 2 Alt raised, 0 m, no landing"
