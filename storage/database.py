# SPDX-License-Identifier: GPL-3.0-or-later
"""Open the database file: check its integrity, make commits durable, create its tables.

Every start checks for damage, because SD cards decay and lose power. A damaged file is renamed instead
of repaired or deleted, so that `sqlite3` can still open it, and a new database takes its place. SQLite detects
damaged page structures, but not a changed byte in a value: so every row has a checksum.
"""

import re
import sqlite3
import stat
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path

from storage.os_error import reason
from storage.store_error import FAILURES, StoreError, explained, primary_code

#: The columns of `missions` that its crc32 covers.
SUMMARY = (
    "number, received_at, source, verdict, ack, item_count, finding_count, record_count, checksum, outcome, detail,"
    " concluded_at"
)
#: The columns of `mission_contents` that its crc32 covers.
CONTENTS = ("items", "findings", "stored_items", "roi_commands", "records", "sent_seqs")
#: The columns of `settings_backups` that its crc32 covers.
BACKUP = "number, board, kind, taken_at, occasion, setting_count, changed_count, contents"

_SCHEMA = Path(__file__).with_name("schema.sql")
#: SQLite's auxiliary files of a database. The first holds commits that are not in the main file yet.
COMPANIONS = ("-wal", "-shm", "-journal")

_READER_TIMEOUT_S = 2.0
#: Bytes; 65,535 items are 10 MB of text.
_LARGEST_VALUE = 64 << 20
#: Damaged files kept, the latest: each may be as large as the store.
_MOST_KEPT = 3
_ASIDE = re.compile(r"\.corrupt-[0-9]{8}-[0-9]{6}(-[0-9]+)?\Z")
# SQLITE_ERROR is "table already exists" and such: the file does not have its claimed schema.
_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)


def open_database(path: Path, now: float) -> tuple[sqlite3.Connection, Path | None]:
    """Open or create the database. Also returns the new path of a damaged file.

    `now`: unix seconds, for the name of such a file. The caller holds the directory's state_lock: no other process
    may have a file open that is renamed. StoreError if the file cannot be opened, created or written.
    """
    failure = f"cannot open the mission store {path}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{failure}: its directory cannot be created ({reason(error)})") from error
    with explained(failure), ExitStack() as undo:
        is_emptied = path.exists() and path.stat().st_size < 2  # as by a file system's repair: SQLite takes it for new
        connection = _connect(path)
        undo.callback(connection.close)
        aside = None
        if is_emptied or not _make_ready(connection):
            # Moved before it is closed: closing would write the log into the damaged file and delete it.
            aside = _keep_aside(path, now)
            connection.close()
            connection = _connect(path)
            undo.callback(connection.close)
            _prepare(connection)
        undo.pop_all()
        return connection, aside


def read_database(path: Path) -> sqlite3.Connection:
    """Open the database read-only, with or without a running daemon. Raises StoreError if that fails.

    The reader may be root, and the file from a service that was taken over.
    """
    failure = f"cannot read the mission store {path}"
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            raise StoreError(f"{failure}: it is not a regular file")
    except OSError as error:
        raise StoreError(f"{failure}: {reason(error)}") from error
    with explained(failure):
        # Not created or changed: the file may be another user's.
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=_READER_TIMEOUT_S)
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST_VALUE)
        connection.execute("PRAGMA trusted_schema = OFF")
        return configured(connection)


def memory_database() -> sqlite3.Connection:
    """A database of this release's schema that ends with the process."""
    connection = _connect(":memory:")
    _create_tables(connection)
    return connection


@contextmanager
def transaction(connection: sqlite3.Connection, failure: str) -> Iterator[None]:
    """A transaction. Once it returns, the data is on disk. StoreError begins with `failure`."""
    with explained(failure):
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            connection.execute("COMMIT")
        except BaseException:
            if connection.in_transaction:  # SQLite itself has rolled back after some errors
                connection.execute("ROLLBACK")
            raise


def insert(connection: sqlite3.Connection, table: str, row: Mapping[str, object]) -> int:
    """Insert a row, by column. Returns its number."""
    marks = ", ".join("?" * len(row))
    cursor = connection.execute(f"INSERT INTO {table} ({', '.join(row)}) VALUES ({marks})", (*row.values(),))  # noqa: S608 - constants
    assert cursor.lastrowid is not None  # an INSERT that did not raise has made a row
    return cursor.lastrowid


def row_crc32(*values: object) -> int:
    """The checksum of a row, over the columns of SUMMARY, CONTENTS or BACKUP. Damaged values may have any type."""
    return zlib.crc32(repr(values).encode(errors="backslashreplace"))


def _connect(path: Path | str) -> sqlite3.Connection:
    # Transactions are explicit (isolation_level). The caller ensures that one thread at a time uses the
    # connection, not necessarily the one that opened it. Only a tool such as sqlite3 can hold a lock, and a
    # ground station waits for it, so the timeout is short (seconds).
    connection = sqlite3.connect(path, timeout=0.5, isolation_level=None, check_same_thread=False)
    return configured(connection)


def configured(connection: sqlite3.Connection) -> sqlite3.Connection:
    connection.row_factory = sqlite3.Row
    # A corrupt byte in one text must not hide all the other missions.
    connection.text_factory = lambda raw: raw.decode(errors="replace")
    connection.create_function("row_crc32", -1, row_crc32, deterministic=True)
    return connection


def _make_ready(connection: sqlite3.Connection) -> bool:
    """Prepare the connection. Returns False if a page or the schema is damaged, or of another release."""
    try:
        # Reads every page. integrity_check would also look up every row in every index: slow, for little use.
        (finding,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        if finding != "ok":
            return False
        _prepare(connection)
        return _has_our_schema(connection)
    except FAILURES as error:
        if primary_code(error) in _DAMAGE:
            return False
        raise


def _keep_aside(path: Path, now: float) -> Path:
    """Rename the file and its auxiliary files, and delete the oldest such files. Returns the new name.

    The main file goes last: if it went first, a power cut here would leave a log that SQLite deletes.
    """
    stamp = datetime.fromtimestamp(now, UTC).strftime("%Y%m%d-%H%M%S")
    aside = path.with_name(f"{path.name}.corrupt-{stamp}")
    attempt = 1
    while aside.exists():
        attempt += 1
        aside = path.with_name(f"{path.name}.corrupt-{stamp}-{attempt}")
    try:
        for suffix in COMPANIONS:
            companion = path.with_name(path.name + suffix)
            if companion.exists():
                companion.rename(aside.with_name(aside.name + suffix))
        path.rename(aside)
        _forget_oldest(path, aside)
    except OSError as error:
        raise StoreError(
            f"the mission store {path} is corrupt and cannot be renamed ({reason(error)}); move it away"
        ) from error
    return aside


def kept_aside(path: Path) -> list[Path]:
    """The damaged files that were renamed, in the order of their names."""
    return sorted(file for file in path.parent.glob(f"{path.name}.*") if _ASIDE.search(file.name))


def _forget_oldest(path: Path, newest: Path) -> None:
    """Delete the oldest such files. Their missions that could be read are in the store."""
    kept = [file for file in kept_aside(path) if file != newest]
    kept.sort(key=lambda file: (file.stat().st_ctime_ns, file.name))
    for file in kept[: -(_MOST_KEPT - 1)]:
        for suffix in ("", *COMPANIONS):
            file.with_name(file.name + suffix).unlink(missing_ok=True)


def _prepare(connection: sqlite3.Connection) -> None:
    """Make commits durable, and create the tables in a new file."""
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")  # NORMAL would lose the last commits in a power cut
    # KiB. The default of 2 MB would let the daemon grow with every mission.
    connection.execute("PRAGMA cache_size = -256")
    # Finds a read-only file now, not when a mission arrives. Rolled back, it does not take space.
    connection.executescript("BEGIN; PRAGMA user_version = 0; ROLLBACK")
    _create_tables(connection)


def _create_tables(connection: sqlite3.Connection) -> None:
    """Create the tables that are missing."""
    try:
        connection.executescript(f"BEGIN IMMEDIATE;\n{_SCHEMA.read_text()}\nCOMMIT;")
    except FAILURES:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


def _has_our_schema(connection: sqlite3.Connection) -> bool:
    """Compare the schema with that of the schema file: quick_check misses a corrupt column name."""
    with closing(memory_database()) as sample:
        expected, found = (
            {(str(name), str(sql)) for name, sql in database.execute("SELECT name, sql FROM sqlite_schema")}
            for database in (sample, connection)
        )
    return expected <= found  # the user may have added a view
