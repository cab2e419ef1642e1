# SPDX-License-Identifier: GPL-3.0-or-later
"""Open the database file: check its integrity, make commits durable, migrate it to this release's schema.

Every start checks for damage, because SD cards decay and lose power. A damaged file is neither repaired
nor deleted: it is renamed so that `sqlite3` can still open it, and a new one takes its place. SQLite detects damaged
page structures, but not a changed byte in a value: so every row has a checksum.
"""

import re
import sqlite3
import stat
import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path

from storage.os_error import reason
from storage.small_files import open_regular
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

# SQLite's auxiliary files of a database. The log holds commits that are not in the main file yet.
_LOG = "-wal"
_COMPANIONS = (_LOG, "-shm", "-journal")

# The magic number gives the byte order of the log's checksums (https://sqlite.org/fileformat2.html, 4).
_LOG_HEADER = struct.Struct(">8I")
_LOG_MAGIC = {0x377F0682: "<6I", 0x377F0683: ">6I"}

_READER_TIMEOUT_S = 2.0
#: Bytes; 65,535 items are 10 MB of text.
_LARGEST_VALUE = 64 << 20
#: Damaged and newer files kept, the latest: each may be as large as the store.
_MOST_KEPT = 3
_ASIDE = re.compile(r"\.(corrupt|newer)-[0-9]{8}-[0-9]{6}(-[0-9]+)?\Z")
# SQLITE_ERROR is "table already exists" and such: the file does not have its claimed schema.
_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)


def open_database(path: Path, now: float) -> tuple[sqlite3.Connection, Path | None]:
    """Open or create the database; also returns the new path of one that is damaged or of a newer release.

    `now`: unix seconds, for the name of such a file. The caller holds the directory's state_lock: no other process
    may have a file open that is renamed. StoreError if the file cannot be opened, created or written.
    """
    failure = f"cannot open the mission store {path}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{failure}: its directory cannot be created ({reason(error)})") from error
    with explained(failure), ExitStack() as undo:
        connection = _connect(path)
        undo.callback(connection.close)
        aside = None
        if unfit := _make_ready(connection, path):
            # Moved before it is closed: closing would write the log into the damaged file and delete it.
            aside = _keep_aside(path, now, unfit)
            connection.close()
            connection = _connect(path)
            undo.callback(connection.close)
            _prepare(connection)
        undo.pop_all()
        return connection, aside


def read_database(path: Path) -> sqlite3.Connection:
    """Open the database read-only, with or without a running daemon; StoreError if that fails.

    The reader may be root, and the file from a service that was taken over.
    """
    failure = f"cannot read the mission store {path}"
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            raise StoreError(f"{failure}: it is not a regular file")
    except OSError as error:
        raise StoreError(f"{failure}: {reason(error)}") from error
    with explained(failure):
        # Neither created nor changed: the file may be another user's.
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=_READER_TIMEOUT_S)
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST_VALUE)
        connection.execute("PRAGMA trusted_schema = OFF")
        return configured(connection)


def memory_database() -> sqlite3.Connection:
    """A database of this release's schema that ends with the process."""
    connection = _connect(":memory:")
    migrate(connection)
    return connection


@contextmanager
def transaction(connection: sqlite3.Connection, failure: str) -> Iterator[None]:
    """A transaction; once it returns, the data is on disk. StoreError begins with `failure`."""
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
    """Insert a row, by column; returns its number."""
    marks = ", ".join("?" * len(row))
    cursor = connection.execute(f"INSERT INTO {table} ({', '.join(row)}) VALUES ({marks})", (*row.values(),))  # noqa: S608 - constants
    assert cursor.lastrowid is not None  # an INSERT that did not raise has made a row
    return cursor.lastrowid


def row_crc32(*values: object) -> int:
    """The checksum of a row of `missions`, over the columns of SUMMARY, or of `settings_backups`, over BACKUP."""
    return zlib.crc32(repr(values).encode(errors="backslashreplace"))


def contents_crc32(contents: Iterable[object]) -> int:
    """The checksum of a row of `mission_contents`, over the columns of CONTENTS; a damaged one may have any type."""
    crc = 0
    for part in contents:
        crc = zlib.crc32(part if isinstance(part, bytes) else str(part).encode(errors="surrogateescape"), crc)
    return crc


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


def _make_ready(connection: sqlite3.Connection, path: Path) -> str:
    """Prepare the connection; returns why it cannot be used, or "" if the log, every page and the schema are sound.

    A newer file is of a release from which the pilot went back to this one.
    """
    if _log_was_lost(path):
        return "corrupt"
    try:
        # Reads every page. integrity_check would also look up every row in every index: slow, for little use.
        (finding,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        if finding != "ok":
            return "corrupt"
        (version,) = connection.execute("PRAGMA user_version").fetchone()
        if version > len(_schema_steps()):
            return "newer"
        _prepare(connection)
        return "" if _has_our_schema(connection) else "corrupt"
    except FAILURES as error:
        if primary_code(error) in _DAMAGE:
            return "corrupt"
        raise


def _log_was_lost(path: Path) -> bool:
    """True if the log holds commits that SQLite would discard silently.

    It does so if the main file is empty, or the log's header damaged. A header of zeros, or a partial one, is not
    damage: the power failed before the first commit.
    """
    log = path.with_name(path.name + _LOG)
    try:
        with open_regular(log) as file:
            header = file.read(_LOG_HEADER.size)
        if not any(header):
            return False
        if path.stat().st_size <= 1:  # SQLite treats one byte as empty
            return True
    except OSError:
        return False  # no log, or unreadable, for which SQLite has a better message
    if len(header) < _LOG_HEADER.size:
        return False
    *words, first_sum, second_sum = _LOG_HEADER.unpack(header)
    order = _LOG_MAGIC.get(words[0])
    return order is None or _log_checksum(struct.unpack_from(order, header)) != (first_sum, second_sum)


def _log_checksum(words: tuple[int, ...]) -> tuple[int, int]:
    """SQLite's own checksum over 32-bit words (fileformat2, 4.2)."""
    first = second = 0
    for even, odd in zip(words[::2], words[1::2], strict=True):
        first = (first + even + second) & 0xFFFFFFFF
        second = (second + odd + first) & 0xFFFFFFFF
    return first, second


def _keep_aside(path: Path, now: float, why: str) -> Path:
    """Rename the file and its auxiliary files, and delete the oldest such files; returns the new name.

    The main file goes last: if it went first, a power cut here would leave a log that SQLite deletes.
    """
    stamp = datetime.fromtimestamp(now, UTC).strftime("%Y%m%d-%H%M%S")
    aside = path.with_name(f"{path.name}.{why}-{stamp}")
    attempt = 1
    while aside.exists():
        attempt += 1
        aside = path.with_name(f"{path.name}.{why}-{stamp}-{attempt}")
    try:
        for suffix in _COMPANIONS:
            companion = path.with_name(path.name + suffix)
            if companion.exists():
                companion.rename(aside.with_name(aside.name + suffix))
        path.rename(aside)
        _forget_oldest(path, aside)
    except OSError as error:
        raise StoreError(
            f"the mission store {path} is {why} and cannot be renamed ({reason(error)}); move it away"
        ) from error
    return aside


def kept_aside(path: Path) -> list[Path]:
    """The damaged and newer files that were renamed, in the order of their names."""
    return sorted(file for file in path.parent.glob(f"{path.name}.*") if _ASIDE.search(file.name))


def _forget_oldest(path: Path, newest: Path) -> None:
    """Delete the oldest such files. Their missions that could be read are in the store."""
    kept = [file for file in kept_aside(path) if file != newest]
    kept.sort(key=lambda file: (file.stat().st_ctime_ns, file.name))
    for file in kept[: -(_MOST_KEPT - 1)]:
        for suffix in ("", *_COMPANIONS):
            file.with_name(file.name + suffix).unlink(missing_ok=True)


def _prepare(connection: sqlite3.Connection) -> None:
    """Make commits durable and migrate the file to this release's schema."""
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")  # NORMAL would lose the last commits in a power cut
    # KiB. The default of 2 MB would let the daemon grow with every mission.
    connection.execute("PRAGMA cache_size = -256")
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    # Finds a read-only file now, not when a mission arrives. Rolled back, it takes no space.
    connection.executescript(f"BEGIN; PRAGMA user_version = {version}; ROLLBACK")
    migrate(connection)


def _schema_steps() -> list[str]:
    """The schema files' texts in the order of their numbers; step n migrates version n-1 to n."""
    return _schema_files("0*.sql")


def _schema_files(pattern: str) -> list[str]:
    return [file.read_text() for file in sorted(Path(__file__).with_name("schema").glob(pattern))]


def migrate(connection: sqlite3.Connection) -> None:
    """Apply the steps that are missing, each in its own transaction, and make the added tables.

    Added tables have no step: an older release, to which the pilot may go back, leaves them alone.
    """
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    for number, sql in enumerate(_schema_steps()[version:], start=version + 1):
        try:
            connection.executescript(f"BEGIN IMMEDIATE;\n{sql}\nPRAGMA user_version = {number};\nCOMMIT;")
        except FAILURES:
            if connection.in_transaction:
                connection.execute("ROLLBACK")
            raise
    for sql in _schema_files("added_*.sql"):
        connection.executescript(f"BEGIN IMMEDIATE;\n{sql}\nCOMMIT;")


def _has_our_schema(connection: sqlite3.Connection) -> bool:
    """Compare the schema with that of the schema files: quick_check misses a corrupt column name."""
    with closing(memory_database()) as sample:
        expected, found = (
            {(str(name), str(sql)) for name, sql in database.execute("SELECT name, sql FROM sqlite_schema")}
            for database in (sample, connection)
        )
    return expected <= found  # the user may have added a view
