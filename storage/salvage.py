# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies intact missions and backups of settings from a damaged store into a new one.

A mission is intact if both its rows match their checksums. Rows are looked up by number, so a damaged page loses
only the rows on it.
"""

import shutil
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from storage.database import BACKUP, CONTENTS, SUMMARY, configured, contents_crc32, migrate, row_crc32
from storage.store_error import FAILURES

#: A damaged table may claim any number; a store within its budget holds fewer.
_MOST = 200_000
_WAL = "-wal"
_MISSION_NUMBERS = (
    "SELECT max(number) FROM missions",
    "SELECT max(number) FROM mission_contents",
    "SELECT seq FROM sqlite_sequence WHERE name = 'missions'",
)
_BACKUP_NUMBERS = (
    "SELECT max(number) FROM settings_backups",
    "SELECT seq FROM sqlite_sequence WHERE name = 'settings_backups'",
)


def salvage(damaged: Path, store: sqlite3.Connection) -> int:
    """Copy the intact rows from the file `damaged`, which is not changed; returns the number of missions.

    SQLite reads a copy in the same directory, because opening applies the log, and /tmp may be too small.
    """
    try:
        with TemporaryDirectory(prefix="salvage-", dir=damaged.parent) as folder:
            copy = Path(folder) / "missions.db"
            shutil.copyfile(damaged, copy)
            with suppress(FileNotFoundError):
                shutil.copyfile(damaged.with_name(damaged.name + _WAL), copy.with_name(copy.name + _WAL))
            return _copy_missions(copy, store)
    except (*FAILURES, OSError):
        return 0


def _copy_missions(path: Path, store: sqlite3.Connection) -> int:
    copied = 0
    with closing(configured(sqlite3.connect(path, isolation_level=None))) as source:
        source.text_factory = lambda raw: raw.decode(errors="surrogateescape")
        source.row_factory = None
        with suppress(*FAILURES):  # the file may be of an older release
            migrate(source)
        store.execute("BEGIN IMMEDIATE")
        try:
            for number in range(1, _last(source, _MISSION_NUMBERS) + 1):
                with suppress(*FAILURES, TypeError):  # TypeError: there is no such row
                    copied += _copy_mission(number, source, store)
            for number in range(1, _last(source, _BACKUP_NUMBERS) + 1):
                with suppress(*FAILURES, TypeError):
                    _copy_backup(number, source, store)
            store.execute("COMMIT")
        except BaseException:
            store.execute("ROLLBACK")
            raise
    return copied


def _last(source: sqlite3.Connection, questions: tuple[str, ...]) -> int:
    last = 0
    for question in questions:
        with suppress(*FAILURES, TypeError, ValueError):
            (found,) = source.execute(question).fetchone() or (0,)
            last = max(last, int(found or 0))
    return min(last, _MOST)


def _copy_backup(number: int, source: sqlite3.Connection, store: sqlite3.Connection) -> None:
    *row, crc32 = source.execute(f"SELECT {BACKUP}, crc32 FROM settings_backups WHERE number = ?", (number,)).fetchone()  # noqa: S608
    if row_crc32(*row) == crc32:
        _insert(store, f"settings_backups ({BACKUP}, crc32)", (*row, crc32))


def _copy_mission(number: int, source: sqlite3.Connection, store: sqlite3.Connection) -> int:
    *summary, row_crc = source.execute(f"SELECT {SUMMARY}, crc32 FROM missions WHERE number = ?", (number,)).fetchone()  # noqa: S608
    *contents, crc32 = source.execute(
        f"SELECT {', '.join(CONTENTS)}, crc32 FROM mission_contents WHERE number = ?",  # noqa: S608
        (number,),
    ).fetchone()
    if row_crc32(*summary) != row_crc or contents_crc32(contents) != crc32:
        return 0
    store.execute("SAVEPOINT mission")
    try:
        # STRICT tables reject values of the wrong type.
        _insert(store, f"missions ({SUMMARY}, crc32)", (*summary, row_crc))
        _insert(store, f"mission_contents (number, {', '.join(CONTENTS)}, crc32)", (number, *contents, crc32))
    except FAILURES:
        store.execute("ROLLBACK TO mission")
        return 0
    finally:
        store.execute("RELEASE mission")
    return 1


def _insert(store: sqlite3.Connection, table: str, values: tuple[object, ...]) -> None:
    store.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(values))})", values)  # noqa: S608
