"""The one error of this package, and SQLite's error codes in a person's words."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager


class StoreError(Exception):
    """One sentence for a person: what could not be done, where, why, and what to do about it."""


# By primary result code (https://sqlite.org/rescode.html); an extended code adds which system call it was.
_REASONS = {
    sqlite3.SQLITE_FULL: "the disk is full; free some space",
    sqlite3.SQLITE_IOERR: "the disk is full or failing; look at df and dmesg",
    sqlite3.SQLITE_READONLY: "it may not be written; look at its owner and mode, and at the mount",
    sqlite3.SQLITE_PERM: "it may not be opened; look at its owner and mode",
    sqlite3.SQLITE_CANTOPEN: "it cannot be opened or made; look at the directory's owner, mode and mount",
    sqlite3.SQLITE_BUSY: "another process keeps it locked; end that one",
    sqlite3.SQLITE_CORRUPT: "it is damaged; a restart keeps it aside and makes a new one",
    sqlite3.SQLITE_NOTADB: "it is no database any more; a restart keeps it aside and makes a new one",
}


def primary_code(error: sqlite3.Error) -> int | None:
    """SQLite's primary result code; None if the error came from Python's own module."""
    code = getattr(error, "sqlite_errorcode", None)
    return None if code is None else code & 0xFF


@contextmanager
def explained(failure: str) -> Iterator[None]:
    """Turn what SQLite raises into a StoreError that starts with `failure`, e.g. "cannot open /x/y.db"."""
    try:
        yield
    except sqlite3.Error as error:
        code = primary_code(error)
        reason = _REASONS.get(code) if code is not None else None
        raise StoreError(f"{failure}: {reason} ({error})" if reason else f"{failure}: {error}") from error
