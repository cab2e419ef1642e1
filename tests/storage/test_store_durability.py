# SPDX-License-Identifier: GPL-3.0-or-later
"""Acknowledged missions survive kill -9 and power cuts during a write."""

import os
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from storage.mission_store import open_store
from tests.support.sample_missions import intact, mission, received

#: `make soak` repeats it 200 times.
KILLS = int(os.environ.get("STORE_KILLS", "8"))

# Adds and concludes missions at full speed; prints each only after the store has returned.
WRITER = """
import sys
from pathlib import Path
from tests.support.sample_missions import mission
from storage.mission_store import open_store

store = open_store(Path(sys.argv[1]), now=0.0).store
number = store.list(1)[0].number if store.list(1) else 0
while True:
    number = store.add(mission(number + 1, items=40))
    print(number, "PENDING", flush=True)
    store.conclude(number, "VERIFIED", f"answer {number}", float(number))
    print(number, "VERIFIED", flush=True)
"""


def test_kill_9_keeps_everything_acknowledged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "missions.db"
    chance = random.Random(1)
    acknowledged: dict[int, str] = {}
    for kill in range(1, KILLS + 1):
        writer = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path)],
            stdout=subprocess.PIPE,
            text=True,
            env={"PYTHONPATH": f"{Path(__file__).parents[2]}:{Path(__file__).parent}"},
        )
        assert writer.stdout is not None
        with writer, writer.stdout:
            lines = [writer.stdout.readline() for _ in range(chance.randrange(1, 120))]
            time.sleep(chance.random() * 0.005)  # anywhere within the next write
            writer.kill()
            lines += writer.stdout.readlines()
        # An incomplete last line does not count.
        acknowledged.update((int(number), outcome) for number, outcome in map(str.split, filter(_whole, lines)))

        with intact(path) as store:
            for number, outcome in acknowledged.items():
                stored = store.get(number)
                assert stored is not None
                assert stored.received == mission(number, items=40)
                assert outcome == "PENDING" or stored.detail == f"answer {number}"
            assert len(store.list(100_000)) <= len(acknowledged) + kill  # the last may not be printed yet
    with capsys.disabled():
        print(f"\n{KILLS} x kill -9: all {len(acknowledged)} acknowledged missions are there")  # noqa: T201


def _whole(line: str) -> bool:
    return line.endswith("\n")


def test_a_power_cut_damages_only_unacknowledged_data(tmp_path: Path) -> None:
    """After add() has returned, the log up to that point is on the disk; any part of later writes may be."""
    path = tmp_path / "live" / "missions.db"
    log = path.with_name("missions.db-wal")
    chance = random.Random(5)
    with open_store(path, now=0.0).store as store:
        number = store.add(mission(1))
        main, synced = path.read_bytes(), log.read_bytes()
        store.add(mission(2, items=100))
        rest = log.read_bytes()[len(synced) :]
        assert path.read_bytes() == main  # no checkpoint in between, or this test would prove nothing
    assert len(rest) > 4096
    for trial in range(40):
        torn = bytearray(rest[: chance.randrange(len(rest))])
        for _ in range(chance.randrange(3)):  # sectors are written in any order
            hole = chance.randrange(0, max(len(torn), 1), 512)
            torn[hole : hole + 512] = bytes(len(torn[hole : hole + 512]))
        copy = tmp_path / f"cut{trial}" / "missions.db"
        copy.parent.mkdir()
        copy.write_bytes(main)
        copy.with_name("missions.db-wal").write_bytes(synced + torn)
        with intact(copy) as store:
            assert received(store, number) == mission(1)
            assert store.add(mission(3)) > number
        shutil.rmtree(copy.parent)


@pytest.mark.parametrize("size", [0, 1, 31, 32, 4096])
def test_a_power_cut_before_the_first_commit_is_not_damage(tmp_path: Path, size: int) -> None:
    """The log was created but never written: its bytes are zeros."""
    path = tmp_path / "missions.db"
    with open_store(path, now=0.0).store as store:
        store.add(mission(1))
    path.with_name("missions.db-wal").write_bytes(bytes(size))
    with intact(path) as store:
        assert [summary.number for summary in store.list(9)] == [1]


def test_commits_are_synced_to_the_disk(tmp_path: Path) -> None:
    with open_store(tmp_path / "missions.db", now=0.0).store as store:
        (log_event,) = store._connection.execute("PRAGMA journal_mode").fetchone()
        (synchronous,) = store._connection.execute("PRAGMA synchronous").fetchone()
    assert (log_event, synchronous) == ("wal", 2)
