# SPDX-License-Identifier: GPL-3.0-or-later
"""A full store, and salvage from damaged ones."""

from pathlib import Path

from storage.mission_store import VERIFIED, open_store
from tests.support.sample_missions import mission


def test_a_full_store_loses_rejected_lists_first(tmp_path: Path) -> None:
    with open_store(tmp_path / "missions.db", 0.0, budget=1 << 20).store as store:
        flown = store.add(mission(1))
        store.conclude(flown, VERIFIED, "", 1.0)
        for number in range(2, 400):
            store.conclude(store.add(mission(number, items=40)), "REJECTED", "", 1.0)
        kept = store.list(1000)
        assert len(kept) < 300
        assert kept[-1].number == flown
    assert (tmp_path / "missions.db").stat().st_size < 2 << 20


def test_a_full_store_keeps_a_failed_list_longer_than_rejected_lists(tmp_path: Path) -> None:
    with open_store(tmp_path / "missions.db", 0.0, budget=1 << 20).store as store:
        failed = store.add(mission(1))
        store.conclude(failed, "FAILED", "", 1.0)
        for number in range(2, 400):
            outcome = "REJECTED" if number % 2 else "CANCELLED"
            store.conclude(store.add(mission(number, items=40)), outcome, "", 1.0)
        assert [line.number for line in store.list(1000)][-1] == failed
