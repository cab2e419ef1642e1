# SPDX-License-Identifier: GPL-3.0-or-later
"""A damaged store never stops the daemon: the file is renamed and reported, and a new one is created."""

import random
import sqlite3
from collections.abc import Mapping
from pathlib import Path

import pytest

from storage.mission_store import DAMAGED, MissionStore, ReceivedMission, open_store
from storage.store_error import StoreError
from tests.support.sample_missions import intact, mission, received

NOW = 1_767_323_045.9  # 2026-01-02 03:04:05 UTC
ASIDE = "missions.db.corrupt-20260102-030405"
MISSIONS = 12
ALL = {number: mission(number, items=40) for number in range(1, MISSIONS + 1)}
NOTHING: Mapping[int, ReceivedMission] = {}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cleanly closed store with MISSIONS missions, numbered from 1."""
    path = tmp_path_factory.mktemp("sound") / "missions.db"
    with open_store(path, NOW).store as store:
        for tag in range(1, MISSIONS + 1):
            store.conclude(store.add(mission(tag, items=40)), "VERIFIED", "", 1.0)
    return path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "missions.db"


def assert_works(store: MissionStore) -> None:
    number = store.add(mission(77))
    assert received(store, number) == mission(77)


def assert_kept_aside(path: Path, damaged: bytes, *, salvaged: Mapping[int, ReceivedMission] = NOTHING) -> None:
    """The damaged file is kept byte for byte; the new store holds exactly the missions numbered `salvaged`."""
    opened = open_store(path, NOW)
    with opened.store as store:
        assert opened.set_aside == path.with_name(ASIDE)
        assert opened.set_aside.read_bytes() == damaged
        assert opened.salvaged == len(salvaged)
        assert sorted(summary.number for summary in store.list(99)) == sorted(salvaged)
        for number, sent in salvaged.items():
            assert received(store, number) == sent
        assert_works(store)


@pytest.mark.parametrize("size", [2, 15, 16, 100, 511, 512, 513, 4096, 5000, 100_000])
def test_random_bytes_are_set_aside(path: Path, size: int) -> None:
    damaged = random.Random(size).randbytes(size)
    path.write_bytes(damaged)
    assert_kept_aside(path, damaged)


@pytest.mark.parametrize("size", [16, 99, 100, 512, 2048, 4095, 4096, 4097, 8192, 12_288, 20_480, 50_000])
def test_a_truncated_file_is_set_aside(path: Path, sound: Path, size: int) -> None:
    path.write_bytes(sound.read_bytes()[:size])
    assert_kept_aside(path, sound.read_bytes()[:size])


@pytest.mark.parametrize("content", [b"", b"S"])
def test_an_emptied_file_is_reported(path: Path, content: bytes) -> None:
    """SQLite also treats a file of one byte as empty."""
    path.write_bytes(content)
    assert_kept_aside(path, content)


@pytest.fixture
def killed(path: Path, sound: Path) -> bytes:
    """Leave the files of a killed process, a main file and a log with further commits; return the log."""
    path.write_bytes(sound.read_bytes())
    store = open_store(path, NOW).store
    store.add(mission(50))
    store.add(mission(51))
    main, log = path.read_bytes(), path.with_name("missions.db-wal").read_bytes()
    store.close()
    path.write_bytes(main)
    path.with_name("missions.db-wal").write_bytes(log)
    return log


def test_an_intact_log_is_applied(path: Path, killed: bytes) -> None:
    with intact(path) as store:
        assert len(store.list(99)) == MISSIONS + 2


def test_a_damaged_main_file_keeps_the_log(path: Path, killed: bytes) -> None:
    # Not at its start: for those pages the log holds newer copies.
    damaged = path.read_bytes()[:30_000]
    path.write_bytes(damaged)
    # Only the pages in the log are readable: those of the last two missions.
    assert_kept_aside(path, damaged, salvaged={MISSIONS + 1: mission(50), MISSIONS + 2: mission(51)})
    assert path.with_name(f"{ASIDE}-wal").read_bytes() == killed


def test_the_newest_damaged_files_are_kept(path: Path) -> None:
    """Each may be as large as the store. None is overwritten, even if the Pi's clock jumps back."""
    kept = []
    for size in (10, 20, 30, 40):
        path.write_bytes(b"x" * size)
        opened = open_store(path, NOW)
        opened.store.close()
        kept.append(opened.set_aside)
    assert kept[1:3] == [path.with_name(name) for name in (f"{ASIDE}-2", f"{ASIDE}-3")]
    path.write_bytes(b"x" * 50)
    open_store(path, NOW - 86400).store.close()
    sizes = [file.stat().st_size for file in path.parent.glob("*.corrupt-*")]
    assert sorted(sizes) == [30, 40, 50]


def test_a_file_of_another_program_is_set_aside(path: Path) -> None:
    """An intact database with a table named like ours, but without a schema number, is not ours."""
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE missions (something TEXT)")
    connection.close()
    opened = open_store(path, NOW)
    with opened.store as store:
        assert_works(store)
    assert opened.set_aside == path.with_name(ASIDE)
    connection = sqlite3.connect(opened.set_aside)
    assert connection.execute("SELECT something FROM missions").fetchall() == []
    connection.close()


def test_a_damaged_column_name_is_noticed(path: Path, sound: Path) -> None:
    """SQLite's own check does not find it."""
    content = sound.read_bytes()
    assert content.count(b"received_at   REAL") == 1
    damaged = content.replace(b"received_at   REAL", b"receivef_at   REAL")
    path.write_bytes(damaged)
    assert_kept_aside(path, damaged)


def test_a_schema_that_is_not_utf8_is_noticed(path: Path, sound: Path) -> None:
    damaged = sound.read_bytes().replace(b"CREATE TABLE missions", b"CREATE TABLE \xffissions")
    path.write_bytes(damaged)
    assert_kept_aside(path, damaged)


def test_an_added_view_is_not_damage(path: Path, sound: Path) -> None:
    path.write_bytes(sound.read_bytes())
    connection = sqlite3.connect(path)
    connection.execute("CREATE VIEW refused AS SELECT number FROM missions WHERE outcome = 'REFUSED'")
    connection.close()
    with intact(path) as store:
        assert len(store.list(99)) == MISSIONS


def test_a_damaged_mission_does_not_hide_the_others(path: Path, sound: Path) -> None:
    records = mission(3, items=40).records
    assert sound.read_bytes().count(records[:160]) == 1
    path.write_bytes(sound.read_bytes().replace(records[:160], b"?" + records[1:160]))
    with open_store(path, NOW).store as store:
        with pytest.raises(StoreError, match=r"mission 3 in .* was damaged on the disk"):
            store.get(3)
        assert len(store.list(99)) == MISSIONS
        assert received(store, 4) == mission(4, items=40)


@pytest.mark.parametrize("rotten", [b"\xff", b"U"])
def test_a_damaged_row_does_not_hide_the_list(path: Path, sound: Path, rotten: bytes) -> None:
    source = mission(3).source.encode()
    path.write_bytes(sound.read_bytes().replace(source, rotten + source[1:]))
    with open_store(path, NOW).store as store:
        assert [summary.number for summary in store.list(99) if summary.outcome == DAMAGED] == [3]
        assert {summary.source for summary in store.list(99)} == {
            "",
            *(ALL[number].source for number in ALL if number != 3),
        }
        with pytest.raises(StoreError, match=r"mission 3 in .* was damaged on the disk"):
            store.get(3)
        with pytest.raises(StoreError, match=r"mission 3 in .* was damaged on the disk"):
            store.conclude(3, "VERIFIED", "", 2.0)
