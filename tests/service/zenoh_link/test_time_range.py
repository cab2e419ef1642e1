# SPDX-License-Identifier: GPL-3.0-or-later
"""Time ranges in zenoh's notation."""

import pytest

from service.zenoh_link.time_range import parse_time_range

NOW_S = 1_800_000_000.0


@pytest.mark.parametrize(
    ("text", "start_s", "end_s"),
    [
        ("[now(-1h)..now()]", -3600, 0),
        ("[now(-1.5m)..]", -90, float("inf")),
        ("[..now(-2d)]", float("-inf"), -172800),
        ("[now(-1h)..now(-30m)]", -3600, -1800),
        ("]2027-01-15T08:00:00Z..2027-01-15T08:00:01[", 0, 1),
        ("[2027-01-15T08:00Z..2027-01-15T09:00:00.5+01:00]", 0, 0.5),
    ],
)
def test_a_range_has_its_start_and_end(text: str, start_s: float, end_s: float) -> None:
    found = parse_time_range(text, NOW_S)
    assert (found.start_s - NOW_S, found.end_s - NOW_S) == (start_s, end_s)
    assert max(found.start_s, NOW_S - 1e6) in found


@pytest.mark.parametrize(
    "text", ["", "now()", "[now()]", "[yesterday..]", "[now(-1y)..]", "[..];[..]", "[now(-1h);30m]", "[" * 1000]
)
def test_invalid_ranges_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"write one like \[now"):
        parse_time_range(text, NOW_S)
