# SPDX-License-Identifier: GPL-3.0-or-later
"""A store that is full, and what a damaged one still gives."""

import random
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


def test_what_is_whole_in_a_damaged_store_is_kept(tmp_path: Path) -> None:
    """As an SD card damages it: a page here and there. No mission comes back changed."""
    path = tmp_path / "missions.db"
    with open_store(path, 0.0).store as store:
        for tag in range(1, 61):
            store.conclude(store.add(mission(tag, items=40)), VERIFIED, "", 2.0)
    whole = path.read_bytes()
    draw = random.Random(4)
    salvaged = 0
    for _ in range(20):
        damaged = bytearray(whole)
        page = 4096 * draw.randrange(1, len(damaged) // 4096)
        damaged[page : page + 512] = draw.randbytes(512)
        folder = tmp_path / f"{salvaged} {page}"
        folder.mkdir(exist_ok=True)
        (folder / "missions.db").write_bytes(damaged)
        opened = open_store(folder / "missions.db", 0.0)
        with opened.store as store:
            for kept in store.list(100):
                found = store.get(kept.number)
                assert found is not None
                assert found.received == mission(kept.number, items=40)
            if opened.set_aside is not None:
                assert opened.salvaged == len(store.list(100))
                salvaged += opened.salvaged
    assert salvaged > 20
