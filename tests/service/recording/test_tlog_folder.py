# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder of telemetry logs: its limits, and disk faults."""

import errno
import resource
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from service.recording.tlog_folder import LEFT_FREE, TlogFolder

NOON = datetime(2026, 11, 21, 12, 0, 0, tzinfo=UTC)
RECORD_SIZE = 100
PLENTY = 1 << 40
MOST = 256 << 20


def record(at: datetime = NOON) -> bytes:
    """A record with the fields that the folder uses."""
    return int(at.timestamp() * 1e6).to_bytes(8, "big").ljust(RECORD_SIZE, b"\xfd")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def fill(folder: TlogFolder, began: datetime, records: int, *, is_flight: bool = False) -> None:
    """Write a file of `records` records."""
    for _ in range(records):
        folder.write(record(began), 0.0, is_flight=is_flight)
    folder.close()


def test_files_are_named_after_their_first_record_in_utc(tmp_path: Path) -> None:
    folder = TlogFolder(tmp_path / "state" / "logs", MOST)
    fill(folder, NOON, 3)
    fill(folder, NOON + timedelta(hours=1, seconds=7), 1)
    assert names(tmp_path / "state" / "logs") == ["2026-11-21 12-00-00.tlog", "2026-11-21 13-00-07.tlog"]
    assert (tmp_path / "state" / "logs" / "2026-11-21 12-00-00.tlog").read_bytes() == 3 * record()


def test_setting_the_clock_back_does_not_overwrite_files(tmp_path: Path) -> None:
    folder = TlogFolder(tmp_path, MOST)
    for count in (1, 2, 3):
        fill(folder, NOON, count)
    assert names(tmp_path) == [f"2026-11-21 12-00-0{second}.tlog" for second in (0, 1, 2)]
    assert [(tmp_path / name).stat().st_size for name in names(tmp_path)] == [100, 200, 300]


def test_records_are_in_the_file_at_once(tmp_path: Path) -> None:
    """There is no buffer to be lost with the process."""
    folder = TlogFolder(tmp_path, MOST)
    folder.write(record(), 0.0)
    assert (tmp_path / "2026-11-21 12-00-00.tlog").read_bytes() == record()
    folder.close()


def test_the_oldest_files_are_deleted_to_keep_the_total_size(tmp_path: Path) -> None:
    most = 16_000
    folder = TlogFolder(tmp_path, most)
    for hour in range(20):
        began = NOON + timedelta(hours=hour)
        while not folder.is_full:
            folder.write(record(began), 0.0)
            assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= most
        folder.close()
    assert names(tmp_path) == [
        (NOON + timedelta(hours=hour)).strftime("%Y-%m-%d %H-%M-%S.tlog") for hour in range(4, 20)
    ]


def test_flights_are_deleted_last(tmp_path: Path) -> None:
    folder = TlogFolder(tmp_path, 3000)
    fill(folder, NOON, 5, is_flight=True)
    for minute in range(1, 9):
        fill(folder, NOON + timedelta(minutes=minute), 10)
    assert names(tmp_path)[0] == "2026-11-21 12-00-00 flight.tlog"
    assert len(names(tmp_path)) == 4


def test_other_files_are_not_touched(tmp_path: Path) -> None:
    others = ["2020-01-01 00-00-00.tlog.bak", "2020-01-01 00-00-00.rlog", "flight.tlog", "notes.txt"]
    for name in others:
        (tmp_path / name).write_bytes(bytes(10_000))
    fill(TlogFolder(tmp_path, 2000), NOON, 1)
    assert names(tmp_path) == sorted([*others, "2026-11-21 12-00-00.tlog"])


def test_an_unusable_folder_is_reported_once_and_retried(tmp_path: Path) -> None:
    (tmp_path / "logs").write_text("in the way")
    folder = TlogFolder(tmp_path / "logs", MOST)
    with capture_logs() as events:
        for second in range(200):
            folder.write(record(NOON + timedelta(seconds=second)), float(second))
    assert [event["event"] for event in events if event["log_level"] == "warning"] == ["tlog.stopped"]
    (tmp_path / "logs").unlink()
    with capture_logs() as events:
        for second in range(200, 400):
            folder.write(record(NOON + timedelta(seconds=second)), float(second))
    assert [event["event"] for event in events] == ["tlog.recording"]
    (name,) = names(tmp_path / "logs")
    began = datetime.strptime(name, "%Y-%m-%d %H-%M-%S.tlog").replace(tzinfo=UTC)
    assert began - NOON <= timedelta(seconds=260)
    assert (tmp_path / "logs" / name).stat().st_size == RECORD_SIZE * (400 - (began - NOON) // timedelta(seconds=1))
    folder.close()


@pytest.mark.parametrize("is_recording", [False, True])
def test_does_not_write_to_a_nearly_full_disk(tmp_path: Path, is_recording: bool) -> None:
    free = [PLENTY]
    folder = TlogFolder(tmp_path, MOST, lambda _: free[0])
    if is_recording:
        folder.write(record(), 0.0)
    free[0] = LEFT_FREE
    with capture_logs() as events:
        for second in range(1, 200):
            folder.write(record(NOON + timedelta(seconds=second)), float(second))
    assert [event["event"] for event in events if event["log_level"] == "warning"] == ["tlog.stopped"]
    assert names(tmp_path) == (["2026-11-21 12-00-00.tlog"] if is_recording else [])
    free[0] = PLENTY
    folder.write(record(NOON + timedelta(seconds=300)), 300.0)
    assert names(tmp_path)[-1] == "2026-11-21 12-05-00.tlog"
    folder.close()


def test_a_full_disk_is_reported_once_and_complete_records_can_be_read(tmp_path: Path) -> None:
    """The kernel fails a write within a record; a file size limit stands in for the full disk."""
    folder = TlogFolder(tmp_path, MOST, lambda _: PLENTY)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (250, hard))
    try:
        with capture_logs() as events:
            for second in range(10):
                folder.write(record(NOON + timedelta(seconds=second)), float(second))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [event["event"] for event in events] == ["tlog.recording", "tlog.stopped"]
    assert (tmp_path / "2026-11-21 12-00-00.tlog").stat().st_size == 250
    folder.write(record(NOON + timedelta(seconds=100)), 100.0)
    assert names(tmp_path) == ["2026-11-21 12-00-00.tlog", "2026-11-21 12-01-40.tlog"]
    folder.close()


def test_a_disk_that_becomes_read_only_does_not_end_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel remounts a failing SD card read-only: then the empty file cannot be deleted either."""

    def refuse(*_args: object, **_kwargs: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    free = [0]
    folder = TlogFolder(tmp_path, MOST, lambda _: free[0])
    with monkeypatch.context() as failing:
        failing.setattr(Path, "unlink", refuse)
        folder.write(record(), 0.0)
    assert folder.describe().startswith("stopped, ")
    free[0] = PLENTY
    folder.write(record(NOON + timedelta(seconds=100)), 100.0)
    assert names(tmp_path)[-1] == "2026-11-21 12-01-40.tlog"
    folder.close()
