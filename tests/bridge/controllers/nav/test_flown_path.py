# SPDX-License-Identifier: GPL-3.0-or-later
"""Records that are never flown, landings that the last record decides, and loops in loops."""

import pytest

from bridge.controllers.nav.flown_path import flown_size, jump_within_jump, lands_after_rth
from protocols.msp.nav import NavAction, NavRecord

WP, RTH, RTH_LANDS = (NavRecord(action, p1=p1) for action, p1 in ((1, 0), (4, 0), (4, 1)))


def jump(to: int, repeats: int = 1) -> NavRecord:
    return NavRecord(NavAction.JUMP, p1=to, p2=repeats)


@pytest.mark.parametrize(
    ("records", "size"),
    [
        ([WP, WP, WP], 3),
        ([WP, RTH], 2),
        ([WP, RTH, WP, WP], 2),
        ([WP, jump(4), RTH, WP, RTH, WP], 5),
        ([WP, jump(1, -1), RTH, WP], 3),
        ([WP, jump(4, 0), RTH, WP], 4),
    ],
)
def test_records_behind_an_rth_count_only_if_a_jump_leads_there(records: list[NavRecord], size: int) -> None:
    assert flown_size(records) == size


@pytest.mark.parametrize(
    ("last", "lands"),
    [(RTH, False), (RTH_LANDS, True), (WP, False), (NavRecord(NavAction.WAYPOINT, p1=300), True), (jump(1), False),
     (jump(2), True)],
)  # fmt: skip
def test_the_last_record_decides_the_landing_regardless_of_the_action(last: NavRecord, lands: bool) -> None:
    assert lands_after_rth([RTH_LANDS, WP, last]) is lands


def test_a_loop_within_a_loop_is_found() -> None:
    assert jump_within_jump([WP, WP, jump(2), WP, jump(1)]) == 4
    assert jump_within_jump([WP, WP, jump(1), WP, jump(4)]) is None
