# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder of telemetry logs: one file at a time, bounded in size and total.

Does not read a clock: the time is passed in, or taken from the records themselves.
"""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from io import FileIO
from pathlib import Path

import structlog

from protocols.tlog import first_stamp_us
from storage.os_error import reason

#: Mission Planner's format, but in UTC. The names of flights (the craft was armed) end in " flight".
_NAME_FORMAT = "%Y-%m-%d %H-%M-%S.tlog"
_NAME_PATTERN = re.compile(r"\d{4}-\d\d-\d\d \d\d-\d\d-\d\d( flight)?\.tlog")
_FLIGHT = " flight"
#: One file may have this part of the total, plus up to a second's records.
_FILES = 16
#: The pause after a failure: a full or read-only disk rarely recovers at once.
_RETRY_S = 60.0
#: The maximum loss in a power cut. Syncing more often wears out an SD card.
_SYNC_S = 5.0
#: Disk space that logs never use: a mission must still fit.
LEFT_FREE = 32 << 20

_log = structlog.get_logger()


def is_log_name(name: str) -> bool:
    """True for names of this folder's logs; never for a path out of it."""
    return _NAME_PATTERN.fullmatch(name) is not None


def free_space(folder: Path) -> int:
    """The free space on the folder's disk, bytes."""
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize


class TlogFolder:
    """Appends to a file that is opened at the first write. `most`: the bytes of all files together.

    Disk errors must not affect a flight, so methods do not raise. A failure is logged once, and retried later.
    """

    def __init__(self, folder: Path, most: int, measure_free_space: Callable[[Path], int] = free_space) -> None:
        self._folder = folder
        self._most, self._most_of_one = most, most // _FILES
        self._measure_free_space = measure_free_space
        #: Without a buffer: written bytes survive a crash of this process.
        self._file: FileIO | None = None
        self._path = folder
        self._synced_at = 0.0
        self._retry_at = 0.0
        self._trouble = ""

    @property
    def is_full(self) -> bool:
        return self._file is not None and self._file.tell() >= self._most_of_one

    def describe(self) -> str:
        """The open file, or the reason why none is open. May be called while another thread writes."""
        trouble = self._trouble
        if self._file is not None:
            return str(self._path)
        return f"stopped, {trouble}" if trouble else f"nothing yet, in {self._folder}"

    def write(self, records: bytes, now: float, *, is_flight: bool = False) -> None:
        """Append whole records to the open file, or to a new file. `now`: seconds of a monotonic clock."""
        if not records or now < self._retry_at:
            return
        try:
            if self._file is None:
                self._path = self._new_path(datetime.fromtimestamp(first_stamp_us(records) / 1e6, UTC))
                self._file = FileIO(self._path, "x")
            if self._measure_free_space(self._folder) < LEFT_FREE + len(records):
                raise _LittleSpaceError(f"less than {LEFT_FREE >> 20} MB of the disk are free")
            if is_flight and not _is_flight(self._path):
                self._path = self._path.rename(_of_flight(self._path))
            is_first = not self._file.tell()
            rest = memoryview(records)
            while rest:
                rest = rest[self._file.write(rest) :]
            if is_first:
                _log.info("tlog.recording", file=str(self._path))
                self._trouble = ""
            if now >= self._synced_at + _SYNC_S:
                os.fdatasync(self._file.fileno())
                self._synced_at = now
        except OSError as error:
            self._give_up(error, now)

    def close(self) -> None:
        """Close the open file, and delete it if it is empty. The next `write` begins another."""
        if self._file is not None:
            file, self._file = self._file, None
            with suppress(OSError), file:
                os.fdatasync(file.fileno())
            with suppress(OSError):
                if not self._path.stat().st_size:
                    self._path.unlink()

    def _new_path(self, began: datetime) -> Path:
        """Name a file after `began`, or the first free second after it: clocks may be set back."""
        self._folder.mkdir(parents=True, exist_ok=True)
        self._make_room()
        while (path := self._folder / began.strftime(_NAME_FORMAT)).exists() or _of_flight(path).exists():
            began += timedelta(seconds=1)
        return path

    def _make_room(self) -> None:
        """Remove the oldest files until another fits, flights last. Files with other names are left alone."""
        sizes = {path: path.stat().st_size for path in self._folder.iterdir() if is_log_name(path.name)}
        total = sum(sizes.values())
        for path in sorted(sizes, key=lambda path: (_is_flight(path), path.name)):
            if total + self._most_of_one <= self._most:
                return
            path.unlink()
            total -= sizes[path]
            _log.debug("tlog.removed", file=str(path))

    def _give_up(self, error: OSError, now: float) -> None:
        self.close()
        self._retry_at = now + _RETRY_S
        level = _log.debug if self._trouble else _log.warning
        self._trouble = reason(error)
        level("tlog.stopped", folder=str(self._folder), why=self._trouble, tried_again_every_s=_RETRY_S)


def _is_flight(path: Path) -> bool:
    return path.stem.endswith(_FLIGHT)


def _of_flight(path: Path) -> Path:
    return path.with_stem(path.stem + _FLIGHT)


class _LittleSpaceError(OSError):
    """The disk is nearly full."""
