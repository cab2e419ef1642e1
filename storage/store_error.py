# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of this package, and SQLite's error codes as plain sentences."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager


class StoreError(Exception):
    """One sentence for the user: the failed operation, where, why, and what to do about it."""


# By primary result code (https://sqlite.org/rescode.html). Extended codes add the system call.
_REASONS = {
    sqlite3.SQLITE_FULL: "the disk is full; free some space",
    sqlite3.SQLITE_IOERR: "the disk is full or failing; check df and dmesg",
    sqlite3.SQLITE_READONLY: "it cannot be written; check its owner, mode and mount, or move it away",
    sqlite3.SQLITE_PERM: "it cannot be opened; check its owner and mode",
    sqlite3.SQLITE_CANTOPEN: "it cannot be opened or created; check the directory's owner, mode and mount",
    sqlite3.SQLITE_BUSY: "another process has locked it; stop that process",
    sqlite3.SQLITE_CORRUPT: "it is damaged; a restart sets it aside and creates a new one",
    sqlite3.SQLITE_NOTADB: "it is no longer a database; a restart sets it aside and creates a new one",
}


# Raised by the sqlite3 module. The second if SQLite's own message contains a corrupt name.
FAILURES = (sqlite3.Error, UnicodeDecodeError)


def primary_code(error: Exception) -> int:
    """The primary result code of one of FAILURES; SQLITE_MISUSE if Python itself raised it."""
    if isinstance(error, UnicodeDecodeError):
        return sqlite3.SQLITE_CORRUPT
    return getattr(error, "sqlite_errorcode", sqlite3.SQLITE_MISUSE) & 0xFF


@contextmanager
def explained(failure: str) -> Iterator[None]:
    """Convert SQLite's errors to a StoreError that starts with `failure`, e.g. "cannot open /x/y.db"."""
    try:
        yield
    except FAILURES as error:
        reason = _REASONS.get(primary_code(error))
        raise StoreError(f"{failure}: {reason} ({error})" if reason else f"{failure}: {error}") from error
