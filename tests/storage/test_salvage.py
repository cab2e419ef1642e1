# SPDX-License-Identifier: GPL-3.0-or-later
"""Intact missions of a damaged store are kept."""

import os
import random
import shutil
from contextlib import suppress
from pathlib import Path

import pytest

from storage.mission_store import DAMAGED, VERIFIED, open_store
from storage.store_error import StoreError
from tests.support.sample_missions import mission

#: `make soak` repeats it 300 times.
DAMAGES = int(os.environ.get("STORE_DAMAGES", "20"))


def test_intact_missions_in_a_damaged_store_are_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Sectors and bytes are changed at random; no mission and no row of the list reads back changed."""
    path = tmp_path / "missions.db"
    with open_store(path, 0.0).store as store:
        for tag in range(1, 61):
            store.conclude(store.add(mission(tag, items=40)), VERIFIED, "", 2.0)
        lines = {line.number: line for line in store.list(100)}
    whole = path.read_bytes()
    draw = random.Random(4)
    salvaged = set_aside = 0
    for trial in range(DAMAGES):
        damaged = bytearray(whole)
        size = draw.choice((1, 4, 512))
        for _ in range(draw.choice((1, 1, 300 // size or 1))):
            at = draw.randrange(4096, len(damaged) - size)
            damaged[at : at + size] = draw.randbytes(size)
        folder = tmp_path / str(trial)
        folder.mkdir()
        (folder / "missions.db").write_bytes(damaged)
        opened = open_store(folder / "missions.db", 0.0)
        with opened.store as store:
            for line in store.list(100):
                assert line.outcome == DAMAGED or line == lines[line.number]
                with suppress(StoreError):
                    found = store.get(line.number)
                    assert found is not None
                    assert found.received == mission(line.number, items=40)
            if opened.set_aside is not None:
                assert opened.salvaged == len(store.list(100))
                salvaged += opened.salvaged
                set_aside += 1
        shutil.rmtree(folder)
    with capsys.disabled():
        whole_part = f"{salvaged} of {60 * set_aside} missions saved from the {set_aside} stores set aside"
        print(f"\n{DAMAGES} damaged stores: no mission came back changed; {whole_part}")  # noqa: T201
    assert salvaged > DAMAGES
