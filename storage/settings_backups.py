# SPDX-License-Identifier: GPL-3.0-or-later
"""Backups of flight controllers' settings: a history for each board."""

import builtins
import json
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from storage.database import BACKUP, insert, row_crc32, transaction
from storage.store_error import StoreError, explained

#: The newest are kept. 500 settings are 15 kB.
_MOST_OF_BOARD = 50
_MOST = 300
DAMAGED = "DAMAGED"
#: By name. A text where the setting is one.
SettingValues = Mapping[str, float | str]


@dataclass(frozen=True, slots=True)
class BackupLine:
    """One line of a list of backups.

    board: distinguishes boards of one kind. kind: the firmware and the version. taken_at: unix seconds. occasion: why
    it was taken. changed_count: settings that differ from this board's last backup, or None for the first.
    """

    number: int
    board: str
    kind: str
    taken_at: float
    occasion: str
    setting_count: int
    changed_count: int | None


@dataclass(frozen=True, slots=True)
class SettingsBackup:
    """A backup with the values by name."""

    line: BackupLine
    values: SettingValues


class SettingsBackups:
    """The backups in one store. One thread at a time. Every method may raise StoreError."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self._connection = connection
        self._path = path

    def add(self, board: str, kind: str, values: SettingValues, taken_at: float, occasion: str) -> int:
        """Store a table of settings, and drop the oldest. Returns its number.

        A table equal to the board's last backup is not stored again: returns the number of that backup.
        """
        last = self._last(board, kind)
        changed = None if last is None else _changed_count(last.values, values)
        if last is not None and changed == 0:
            return last.line.number
        with transaction(self._connection, f"cannot store the settings in {self._path}"):
            row = {
                "board": board,
                "kind": kind,
                "taken_at": taken_at,
                "occasion": occasion,
                "setting_count": len(values),
                "changed_count": changed,
                "contents": json.dumps(dict(values)),
                "crc32": 0,
            }
            number = insert(self._connection, "settings_backups", row)
            self._connection.execute(
                f"UPDATE settings_backups SET crc32 = row_crc32({BACKUP}) WHERE number = ?",  # noqa: S608 - a constant
                (number,),
            )
            self._connection.execute(
                "DELETE FROM settings_backups WHERE number <= ? OR number IN"
                " (SELECT number FROM settings_backups WHERE board = ? ORDER BY number DESC LIMIT -1 OFFSET ?)",
                (number - _MOST, board, _MOST_OF_BOARD),
            )
        return number

    def get(self, number: int) -> SettingsBackup | None:
        """The backup with this number, None if there is none. StoreError also if it is corrupt."""
        with explained(f"cannot read the settings' backup {number} from {self._path}"):
            row = self._connection.execute(
                f"SELECT {BACKUP}, crc32 FROM settings_backups WHERE number = ?",  # noqa: S608 - a constant
                (number,),
            ).fetchone()
        if row is None:
            return None
        *line, contents, crc32 = row
        if row_crc32(*line, contents) != crc32:
            raise StoreError(f"the settings' backup {number} in {self._path} was damaged on the disk")
        return SettingsBackup(BackupLine(*line), json.loads(contents))

    def newest(self) -> int | None:
        """The number of the last backup of any board, or None if there is none."""
        return self._newest("TRUE")

    def before(self, backup: BackupLine) -> int | None:
        """The number of the same board's backup before, or None if there is none."""
        return self._newest("board = ? AND kind = ? AND number < ?", backup.board, backup.kind, backup.number)

    def list(self, limit: int) -> builtins.list[BackupLine]:
        """The `limit` newest backups of all boards, newest first.

        One that was damaged on the disk has only its number and the occasion DAMAGED.
        """
        with explained(f"cannot list the settings' backups in {self._path}"):
            rows = self._connection.execute(
                f"SELECT {BACKUP}, crc32 FROM settings_backups ORDER BY number DESC LIMIT ?",  # noqa: S608 - a constant
                (limit,),
            ).fetchall()
        return [
            BackupLine(*line)
            if row_crc32(*line, contents) == crc32
            else BackupLine(line[0], "", "", 0.0, DAMAGED, 0, None)
            for *line, contents, crc32 in rows
        ]

    def _last(self, board: str, kind: str) -> SettingsBackup | None:
        """The board's last backup, or None if there is none or it is damaged: the next is then stored in any case."""
        number = self._newest("board = ? AND kind = ?", board, kind)
        try:
            return None if number is None else self.get(number)
        except StoreError:
            return None

    def _newest(self, condition: str, *values: object) -> int | None:
        with explained(f"cannot list the settings' backups in {self._path}"):
            question = f"SELECT max(number) FROM settings_backups WHERE {condition}"  # noqa: S608 - constants
            number: int | None = self._connection.execute(question, values).fetchone()[0]
        return number


def _changed_count(before: SettingValues, after: SettingValues) -> int:
    names = before.keys() | after.keys()
    # repr: NaN is equal to itself.
    return sum(repr(before.get(name)) != repr(after.get(name)) for name in names)
