# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies intact missions from a damaged store into a new one.

A mission is intact if its contents match their checksum. Missions are looked up by number, so a damaged page loses
only the missions on it.
"""

import shutil
import sqlite3
import zlib
from collections.abc import Iterable
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from storage.store_error import FAILURES

_MISSION = (
    "number, received_at, source, verdict, ack, item_count, finding_count, record_count, checksum, outcome, detail,"
    " concluded_at"
)
CONTENTS = ("items", "findings", "stored_items", "roi_commands", "records")  # the columns that crc32 covers
#: A damaged table may claim any number; a store within its budget holds fewer.
_MOST = 200_000
_WAL = "-wal"


def contents_crc32(contents: Iterable[str | bytes]) -> int:
    """Detects a changed byte in a mission; SQLite only detects damaged page structures."""
    crc = 0
    for part in contents:
        crc = zlib.crc32(part if isinstance(part, bytes) else part.encode(errors="surrogateescape"), crc)
    return crc


def salvage(damaged: Path, store: sqlite3.Connection) -> int:
    """Copy the intact missions from the file `damaged`, which is not changed; returns their number.

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
    with closing(sqlite3.connect(path, isolation_level=None)) as source:
        source.text_factory = lambda raw: raw.decode(errors="surrogateescape")
        store.execute("BEGIN IMMEDIATE")
        try:
            for number in range(1, _last_number(source) + 1):
                with suppress(*FAILURES):
                    copied += _copy_mission(number, source, store)
            store.execute("COMMIT")
        except BaseException:
            store.execute("ROLLBACK")
            raise
    return copied


def _last_number(source: sqlite3.Connection) -> int:
    last = 0
    for question in (
        "SELECT max(number) FROM missions",
        "SELECT max(number) FROM mission_contents",
        "SELECT seq FROM sqlite_sequence WHERE name = 'missions'",
    ):
        with suppress(*FAILURES, TypeError, ValueError):
            (found,) = source.execute(question).fetchone() or (0,)
            last = max(last, int(found or 0))
    return min(last, _MOST)


def _copy_mission(number: int, source: sqlite3.Connection, store: sqlite3.Connection) -> int:
    mission = source.execute(f"SELECT {_MISSION} FROM missions WHERE number = ?", (number,)).fetchone()  # noqa: S608
    *contents, crc32 = source.execute(
        f"SELECT {', '.join(CONTENTS)}, crc32 FROM mission_contents WHERE number = ?",  # noqa: S608
        (number,),
    ).fetchone() or (None,)
    if mission is None or not contents or contents_crc32(contents) != crc32:
        return 0
    store.execute("SAVEPOINT mission")
    try:
        # STRICT tables reject values of the wrong type.
        store.execute(f"INSERT INTO missions ({_MISSION}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", mission)  # noqa: S608
        store.execute(
            f"INSERT INTO mission_contents (number, {', '.join(CONTENTS)}, crc32) VALUES (?, ?, ?, ?, ?, ?, ?)",  # noqa: S608
            (number, *contents, crc32),
        )
    except (*FAILURES, UnicodeEncodeError):
        store.execute("ROLLBACK TO mission")
        return 0
    finally:
        store.execute("RELEASE mission")
    return 1
