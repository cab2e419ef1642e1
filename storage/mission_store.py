# SPDX-License-Identifier: GPL-3.0-or-later
"""Every received mission, accepted or not: as sent, as stored, and the outcome. The settings' backups with them."""

import builtins
import json
import sqlite3
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from storage.database import (
    CONTENTS,
    SUMMARY,
    insert,
    memory_database,
    open_database,
    row_crc32,
    transaction,
)
from storage.salvage import salvage
from storage.settings_backups import SettingsBackups
from storage.store_error import StoreError, explained

PENDING = "PENDING"  # the outcome until conclude(). It stays if the daemon dies before
VERIFIED = "VERIFIED"  # the outcome that latest_verified() looks for
DAMAGED = "DAMAGED"  # the outcome in a list if the row does not match the checksum

#: The size limit of the store, bytes.
BUDGET = 200 << 20
#: Missions deleted together, because the search for them is slow.
_DELETED_AT_ONCE = 20
_MOST_SENDERS = 16
_BUDGET_IN_MEMORY = 8 << 20


@dataclass(frozen=True, slots=True)
class ReceivedMission:
    """A mission list and the verdict.

    The dictionaries hold JSON values, NaN and infinities. received_at: unix seconds. source: the sender, e.g.
    "udp 192.168.4.2:14550 sysid 255". items: as sent. verdict: ACCEPTED, CLEARED or REJECTED. ack: the
    MAV_MISSION_ name. stored_items: as the flight controller should hold them. records: the bytes written, of
    `record_count` records. checksum: their CRC-32. roi_commands: by seq, the command number that an ambiguous record
    (a region of interest, a hold) was sent as. sent_seqs: as reports.verdict.SentSeqs.
    """

    received_at: float
    source: str
    items: list[dict[str, Any]]
    verdict: str
    ack: str
    findings: list[dict[str, Any]]
    stored_items: list[dict[str, Any]]
    records: bytes
    record_count: int
    checksum: int
    roi_commands: dict[int, int]
    sent_seqs: list[int | None]


@dataclass(frozen=True, slots=True)
class MissionSummary:
    """One line of a list of missions. Times are unix seconds. concluded_at is None while PENDING.

    finding_count leaves out filled-in defaults. A line that was damaged on the disk has only its number and the
    outcome DAMAGED.
    """

    number: int
    received_at: float
    source: str
    verdict: str
    ack: str
    item_count: int
    finding_count: int
    record_count: int
    checksum: int
    outcome: str
    detail: str
    concluded_at: float | None


@dataclass(frozen=True, slots=True)
class StoredMission:
    """A mission as received, and the outcome."""

    number: int
    received: ReceivedMission
    outcome: str
    detail: str
    concluded_at: float | None


class MissionStore:
    """The missions of one state directory. One thread at a time. Every method may raise StoreError.

    >>> with open_store(state_dir / "missions.db", time.time()).store as store:
    ...     number = store.add(received)
    ...     store.conclude(number, VERIFIED, "", time.time())

    Once add() or conclude() has returned, its data survives a kill and a power cut.
    """

    def __init__(self, connection: sqlite3.Connection, path: Path, budget: int = BUDGET) -> None:
        self._connection = connection
        self._path = path
        self._budget = budget
        self.backups = SettingsBackups(connection, path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; optional: what was stored stays stored."""
        with explained(f"cannot close {self._path}"):
            self._connection.close()

    def add(self, received: ReceivedMission, sender: str = "") -> int:
        """Store a mission with the outcome PENDING. Returns its number, which increases with every mission.

        sender: the ground station that counts the items as in this list, see item_numbers().
        A full store drops others first: rejected and cancelled lists before the rest, verified lists last.
        """
        values = {name: getattr(received, name) for name in CONTENTS}
        contents = {name: each if isinstance(each, bytes) else json.dumps(each) for name, each in values.items()}
        line = {
            "received_at": received.received_at,
            "source": _text(received.source),
            "verdict": _text(received.verdict),
            "ack": _text(received.ack),
            "item_count": len(received.items),
            "finding_count": sum(finding.get("news") != "none" for finding in received.findings),
            "record_count": received.record_count,
            "checksum": received.checksum,
            "outcome": PENDING,
            "sender": _text(sender),
            "detail": "",
        }
        with self._transaction("cannot store the mission"):
            self._make_room()
            number = insert(self._connection, "missions", line)
            crc32 = row_crc32(number, *contents.values())
            insert(self._connection, "mission_contents", {"number": number, **contents, "crc32": crc32})
            self._seal(number)
        return number

    def conclude(self, number: int, outcome: str, detail: str, at: float) -> None:
        """Store the outcome. outcome: VERIFIED, REJECTED, FAILED...; at: unix seconds."""
        with self._transaction(f"cannot store the outcome of mission {number}"):
            if self._line(number) is None:
                raise StoreError(f"there is no mission {number} in {self._path}")
            self._connection.execute(
                "UPDATE missions SET outcome = ?, detail = ?, concluded_at = ? WHERE number = ?",
                (_text(outcome), _text(detail), at, number),
            )
            self._seal(number)

    def get(self, number: int) -> StoredMission | None:
        """The mission with this number, None if there is none. StoreError also if it is corrupt."""
        summary = self._line(number)
        if summary is None:
            return None
        with explained(f"cannot read mission {number} from {self._path}"):
            columns = ", ".join(CONTENTS)
            question = f"SELECT number, {columns}, crc32 FROM mission_contents WHERE number = ?"  # noqa: S608 - constants
            row = self._connection.execute(question, (number,)).fetchone()
        if row is None or row_crc32(*row[:-1]) != row["crc32"]:
            raise self._damaged(number)
        try:
            received = ReceivedMission(
                received_at=summary.received_at,
                source=summary.source,
                items=json.loads(row["items"]),
                verdict=summary.verdict,
                ack=summary.ack,
                findings=json.loads(row["findings"]),
                stored_items=json.loads(row["stored_items"]),
                records=row["records"],
                record_count=summary.record_count,
                checksum=summary.checksum,
                roi_commands={int(seq): command for seq, command in json.loads(row["roi_commands"]).items()},
                sent_seqs=json.loads(row["sent_seqs"]),
            )
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            raise self._damaged(number) from error
        return StoredMission(number, received, summary.outcome, summary.detail, summary.concluded_at)

    def latest_verified(self, count: int, checksum: int) -> StoredMission | None:
        """The newest mission with these records that was verified."""
        with explained(f"cannot search {self._path}"):
            row = self._connection.execute(
                f"SELECT max(number) FROM missions"  # noqa: S608 - a constant; only so is the partial index used
                f" WHERE record_count = ? AND checksum = ? AND outcome = '{VERIFIED}'",
                (count, checksum),
            ).fetchone()
        return None if row[0] is None else self.get(row[0])

    def item_numbers(self, count: int, checksum: int) -> dict[str, builtins.list[int | None]]:
        """The sent_seqs of the stations that sent these records and have not read them back, by their add(sender)."""
        with explained(f"cannot search {self._path}"):
            rows = self._connection.execute(
                f"SELECT sender, max(number) FROM missions WHERE record_count = ? AND checksum = ?"  # noqa: S608
                f" AND outcome = '{VERIFIED}' AND sender != '' GROUP BY sender ORDER BY 2 DESC LIMIT {_MOST_SENDERS}",
                (count, checksum),
            ).fetchall()
        found = {sender: self.get(number) for sender, number in rows}
        return {sender: mission.received.sent_seqs for sender, mission in found.items() if mission is not None}

    def note_reader(self, count: int, checksum: int, sender: str) -> None:
        """The sender of these records has read them back, and counts the items as read."""
        with self._transaction("cannot store a reading"):
            self._connection.execute(
                "UPDATE missions SET sender = '' WHERE record_count = ? AND checksum = ? AND sender = ?",
                (count, checksum, _text(sender)),
            )

    def pending(self) -> builtins.list[MissionSummary]:
        """The missions without a conclusion, oldest first."""
        found = self._summaries(f"WHERE outcome = '{PENDING}' ORDER BY number")
        return [summary for summary in found if summary.outcome == PENDING]

    def list(self, limit: int) -> builtins.list[MissionSummary]:
        """The `limit` newest missions, newest first."""
        return self._summaries("ORDER BY number DESC LIMIT ?", limit)

    def _summaries(self, which: str, *values: float) -> builtins.list[MissionSummary]:
        with explained(f"cannot list {self._path}"):
            rows = self._connection.execute(f"SELECT {SUMMARY}, crc32 FROM missions {which}", values).fetchall()  # noqa: S608 - constants
        return [MissionSummary(*row) if row_crc32(*row) == crc32 else _damaged_line(row[0]) for *row, crc32 in rows]

    def _seal(self, number: int) -> None:
        """Store the checksum of a mission's line."""
        self._connection.execute(
            f"UPDATE missions SET crc32 = row_crc32({SUMMARY}) WHERE number = ?",  # noqa: S608 - a constant
            (number,),
        )

    def _line(self, number: int) -> MissionSummary | None:
        """The line of a mission, or None if there is none, StoreError if it is corrupt."""
        for line in self._summaries("WHERE number = ?", number):
            if line.outcome == DAMAGED:
                raise self._damaged(number)
            return line
        return None

    def _damaged(self, number: int) -> StoreError:
        return StoreError(f"mission {number} in {self._path} was damaged on the disk; the others can still be read")

    def _make_room(self) -> None:
        while self._size() > self._budget:
            oldest = self._connection.execute(
                "SELECT number FROM missions ORDER BY CASE WHEN outcome IN ('REJECTED', 'CANCELLED') THEN 0"
                " WHEN outcome = ? THEN 2 ELSE 1 END, number LIMIT ?",
                (VERIFIED, _DELETED_AT_ONCE),
            ).fetchall()
            if not oldest:
                return
            for (number,) in oldest:
                self._connection.execute("DELETE FROM mission_contents WHERE number = ?", (number,))
                self._connection.execute("DELETE FROM missions WHERE number = ?", (number,))

    def _size(self) -> int:
        """Bytes in use. Freed pages are reused before the file grows."""
        pages, free, page_size = (
            self._connection.execute(f"PRAGMA {name}").fetchone()[0]
            for name in ("page_count", "freelist_count", "page_size")
        )
        return int((pages - free) * page_size)

    def _transaction(self, failure: str) -> AbstractContextManager[None]:
        return transaction(self._connection, f"{failure} in {self._path}")


@dataclass(frozen=True, slots=True)
class OpenedStore:
    """A store ready for use. `set_aside`: the path of a damaged store. `salvaged`: the missions recovered from it."""

    store: MissionStore
    set_aside: Path | None
    salvaged: int


def open_store(path: Path, now: float, budget: int = BUDGET) -> OpenedStore:
    """Open the store in file `path`, or create it and its directory.

    `now`: unix seconds, for the name of a damaged file. `budget`: size limit, bytes. The caller holds
    the directory's state_lock.
    StoreError if it cannot be opened or written.
    """
    connection, set_aside = open_database(path, now)
    salvaged = 0 if set_aside is None else salvage(set_aside, connection)
    return OpenedStore(MissionStore(connection, path, budget), set_aside, salvaged)


def store_in_memory() -> MissionStore:
    """A store in memory, for a disk that cannot be written."""
    return MissionStore(memory_database(), Path("memory"), _BUDGET_IN_MEMORY)


def _damaged_line(number: int) -> MissionSummary:
    return MissionSummary(number, 0.0, "", "", "", 0, 0, 0, 0, DAMAGED, "this line was damaged on the disk", None)


def _text(text: str) -> str:
    r"""The text as SQLite can hold it: the lone surrogates of a file name that is not UTF-8 become \udcXX."""
    return text.encode(errors="backslashreplace").decode()
