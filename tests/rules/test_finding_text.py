# SPDX-License-Identifier: GPL-3.0-or-later
"""The words that a pilot reads."""

import math

import pytest
from rule_items import LAND, ROI, SET_ROI, SPEED, TAKEOFF, TIME, WAYPOINT, item, mission

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.missions.list_check import check_list
from bridge.model.finding import DROPPED, Finding


@pytest.mark.parametrize(
    ("finding", "text"),
    [
        (Finding(3, "alt_m", 0.0, 2, "0 is no flying height"), "WP 3: height 0 -> 2 m (0 is no flying height)"),
        (Finding(3, "p2", None, 2, "hit radius 2..255 m"), "WP 3: p2 none -> 2 (hit radius 2..255 m)"),
        (Finding(0, "p1", 7.0, 1, "brake"), "Home: p1 7 -> 1 (brake)"),
        (Finding(12, "lat_e7", 453838000, 0, "not used by LAND"), "WP 12: lat 45.3838000 -> 0 (not used by LAND)"),
        (Finding(12, "p1", 1.5, 1, "x" * 29), f"WP 12: p1 1.5 -> 1 ({'x' * 29})"),  # 50 characters
        (Finding(12, "p1", 1.5, 1, "x" * 30), "WP 12: p1 1.5 -> 1"),
        (
            Finding(4, "command", 178, DROPPED, "command 178 is not supported"),
            "WP 4: dropped, command 178 is not supported",
        ),
        (Finding(None, "count", 147, "rejected", "147 items, 146 fit"), "Mission: rejected, 147 items, 146 fit"),
        (Finding(1, "p1", math.inf, 0, "not used"), "WP 1: p1 inf -> 0 (not used)"),
    ],
)
def test_text(finding: Finding, text: str) -> None:
    assert finding.text() == text


def test_every_reason_that_the_rules_give_fits_a_statustext() -> None:
    """With three-digit item numbers, and the longest coordinates and heights."""
    far = {"lat_e7": -899999999, "lon_e7": -1799999999}
    before = [item(WAYPOINT)] * 98
    texts = []
    for tail in (
        [item(WAYPOINT, p1=5, p2=300, p3=1, p4=1, alt_m=-40000, frame=10), item(LAND, alt_m=-40000, **far)],
        [item(TIME, p1=300, alt_m=0.5), item(SPEED), item(WAYPOINT, lat_e7=0), item(WAYPOINT, alt_m=math.nan)],
        [item(WAYPOINT, frame=255)],
        [item(WAYPOINT, lat_e7=900000001)],
        [item(WAYPOINT, lon_e7=1800000001)],
        [item(LAND), item(WAYPOINT)],
        [item(TAKEOFF), item(WAYPOINT)],
        [item(WAYPOINT), item(SET_ROI)],
        [item(ROI), item(SPEED)],
    ):
        verdict = check_list(mission(*before, *tail), HarakiriRules())
        texts += [finding.text() for finding in verdict.findings]
    assert len(texts) > 15
    assert [text for text in texts if len(text) > 50] == []
