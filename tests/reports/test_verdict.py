# SPDX-License-Identifier: GPL-3.0-or-later
"""Verdicts on lists."""

from protocols.mission_item import MissionResult
from reports.finding import Finding, RejectingFinding
from reports.verdict import Result, is_renumbered, rejected


def test_a_list_is_renumbered_if_any_item_has_another_number() -> None:
    assert not is_renumbered(())
    assert not is_renumbered((0, 1, 2))
    assert is_renumbered((0, 2))
    assert is_renumbered((0, None, 1)), "an item was inserted"


def test_a_rejection_comes_last_without_records() -> None:
    before, reason = (Finding(seq, "p1", 1, 0, "why") for seq in (1, 2))
    verdict = rejected((before,), RejectingFinding(MissionResult.INVALID_PARAM1, reason))
    assert (verdict.result, verdict.ack, verdict.records) == (Result.REJECTED, MissionResult.INVALID_PARAM1, ())
    assert verdict.findings == (before, reason)
