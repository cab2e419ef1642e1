# SPDX-License-Identifier: GPL-3.0-or-later
"""Backups of settings: what is stored, what is not stored twice, and what survives damage."""

import math
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from storage.mission_store import open_store, store_in_memory
from storage.settings_backups import DAMAGED, SettingsBackups
from storage.store_error import StoreError

TABLE = {"p_roll": 40.0, "i_roll": 30.0, "nan": math.nan}


@pytest.fixture
def backups() -> Iterator[SettingsBackups]:
    with store_in_memory() as store:
        yield store.backups


def test_a_backup_reads_back_with_the_line(backups: SettingsBackups) -> None:
    number = backups.add("a", "Harakiri", TABLE, 5.0, "first met")
    found = backups.get(number)
    assert found is not None
    assert repr(found.values) == repr(TABLE)
    assert backups.list(5) == [found.line]
    line = found.line
    assert (line.board, line.kind, line.taken_at, line.occasion) == ("a", "Harakiri", 5.0, "first met")
    assert (line.setting_count, line.changed_count) == (3, None)
    assert backups.get(number + 1) is None


def test_an_unchanged_table_is_not_stored_again(backups: SettingsBackups) -> None:
    first = backups.add("a", "Harakiri", TABLE, 5.0, "first met")
    assert backups.add("a", "Harakiri", dict(TABLE), 6.0, "saved") == first
    second = backups.add("a", "Harakiri", TABLE | {"p_roll": 41.0, "new": 1.0}, 7.0, "saved")
    third = backups.add("a", "Harakiri", TABLE, 8.0, "saved")
    assert [(line.number, line.changed_count) for line in backups.list(9)] == [(third, 2), (second, 2), (first, None)]


def test_boards_and_versions_have_histories_of_their_own(backups: SettingsBackups) -> None:
    numbers = [
        backups.add(board, kind, TABLE, 5.0, "first met") for board, kind in (("a", "1"), ("b", "1"), ("a", "2"))
    ]
    assert len(set(numbers)) == 3
    newest = backups.add("a", "1", TABLE | {"p_roll": 41.0}, 6.0, "saved")
    found = backups.get(newest)
    assert found is not None
    assert backups.before(found.line) == numbers[0]


def test_the_history_is_bounded(backups: SettingsBackups) -> None:
    kept = backups.add("b", "1", TABLE, 0.0, "first met")
    for step in range(60):
        newest = backups.add("a", "1", TABLE | {"p_roll": float(step)}, 1.0, "saved")
    lines = backups.list(1000)
    assert [line.number for line in lines] == [*range(newest, newest - 50, -1), kept]
    for step in range(400):
        backups.add(f"board {step}", "1", TABLE, 1.0, "first met")
    assert len(backups.list(1000)) == 300


def test_a_damaged_backup_is_not_shown_as_intact(tmp_path: Path) -> None:
    path = tmp_path / "missions.db"
    with open_store(path, 0.0).store as store:
        numbers = [store.backups.add("a", "1", TABLE | {"p_roll": float(step)}, 1.0, "saved") for step in range(3)]
    with closing(sqlite3.connect(path)) as connection, connection:
        changed = "UPDATE settings_backups SET contents = replace(contents, '1.0', '9.0') WHERE number = ?"
        connection.execute(changed, (numbers[1],))
    with open_store(path, 0.0).store as store:
        assert [line.occasion for line in store.backups.list(5)] == ["saved", DAMAGED, "saved"]
        with pytest.raises(StoreError, match="damaged"):
            store.backups.get(numbers[1])


def test_backups_are_salvaged_from_a_damaged_store(tmp_path: Path) -> None:
    path = tmp_path / "missions.db"
    with open_store(path, 0.0).store as store:
        for step in range(40):
            store.backups.add(f"board {step}", "1", {f"setting {n}": float(n * step) for n in range(200)}, 1.0, "saved")
        lines = {line.number: store.backups.get(line.number) for line in store.backups.list(100)}
    whole = bytearray(path.read_bytes())
    middle = len(whole) // 2
    whole[middle : middle + 4000] = bytes(range(250)) * 16
    path.write_bytes(whole)
    opened = open_store(path, 0.0)
    with opened.store as store:
        assert opened.set_aside is not None
        kept = [line.number for line in store.backups.list(100)]
        assert 20 < len(kept) < 40
        assert all(store.backups.get(number) == lines[number] for number in kept)


def test_a_full_disk_is_reported(tmp_path: Path) -> None:
    with open_store(tmp_path / "missions.db", 0.0).store as store:
        store._connection.execute("PRAGMA max_page_count = 1")
        with pytest.raises(StoreError, match="cannot store the settings"):
            store.backups.add("a", "1", {f"{n}": 0.0 for n in range(9000)}, 1.0, "saved")
        assert store.backups.list(5) == []
