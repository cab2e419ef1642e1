# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies intact missions and backups of settings from a damaged store into a new store.

A mission is intact if both its rows match their checksums. Rows are looked up by number, so a damaged page loses
only the rows on it.
"""

import shutil
import sqlite3
from collections.abc import Mapping
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from storage.database import BACKUP, COMPANIONS, CONTENTS, SUMMARY, configured, row_crc32
from storage.store_error import FAILURES

#: A damaged table may claim any number. A store within its budget holds fewer.
_MOST = 200_000
_MISSION = {"missions": SUMMARY, "mission_contents": f"number, {', '.join(CONTENTS)}"}
_BACKUP = {"settings_backups": BACKUP}


def salvage(damaged: Path, store: sqlite3.Connection) -> int:
    """Copy the intact rows from the file `damaged`, which is not changed. Returns the number of missions.

    SQLite reads a copy in the same directory, because opening applies the log, and /tmp may be too small.
    """
    try:
        with TemporaryDirectory(prefix="salvage-", dir=damaged.parent) as folder:
            copy, log = Path(folder) / "missions.db", COMPANIONS[0]
            shutil.copyfile(damaged, copy)
            with suppress(FileNotFoundError):
                shutil.copyfile(damaged.with_name(damaged.name + log), copy.with_name(copy.name + log))
            return _copy_all(copy, store)
    except (*FAILURES, OSError):
        return 0


def _copy_all(path: Path, store: sqlite3.Connection) -> int:
    copied = 0
    with closing(configured(sqlite3.connect(path, isolation_level=None))) as source:
        source.text_factory = lambda raw: raw.decode(errors="surrogateescape")
        source.row_factory = None
        store.execute("BEGIN IMMEDIATE")
        for number in range(1, _last(source, "missions") + 1):
            copied += _copy(number, _MISSION, source, store)
        for number in range(1, _last(source, "settings_backups") + 1):
            _copy(number, _BACKUP, source, store)
        store.execute("COMMIT")
    return copied


def _last(source: sqlite3.Connection, table: str) -> int:
    """The last number that the table ever had, or 0 if it cannot be read."""
    last = 0
    for question in (f"SELECT max(number) FROM {table}", f"SELECT seq FROM sqlite_sequence WHERE name = '{table}'"):  # noqa: S608
        with suppress(*FAILURES, TypeError, ValueError):
            last = max(last, int(source.execute(question).fetchone()[0]))
    return min(last, _MOST)


def _copy(number: int, tables: Mapping[str, str], source: sqlite3.Connection, store: sqlite3.Connection) -> bool:
    """Copy the rows with this number, if all of them are intact. `tables`: columns by table."""
    store.execute("SAVEPOINT entry")
    try:
        for table, columns in tables.items():
            row = source.execute(f"SELECT {columns}, crc32 FROM {table} WHERE number = ?", (number,)).fetchone()  # noqa: S608
            if row is None or row_crc32(*row[:-1]) != row[-1]:
                raise sqlite3.DataError("damaged")
            # STRICT tables reject values of the wrong type.
            store.execute(f"INSERT INTO {table} ({columns}, crc32) VALUES ({', '.join('?' * len(row))})", row)  # noqa: S608
    except FAILURES:
        store.execute("ROLLBACK TO entry")
        return False
    finally:
        store.execute("RELEASE entry")
    return True
