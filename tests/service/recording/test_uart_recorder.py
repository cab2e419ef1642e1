# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures of the flight controller's port: appended to whole, limited in size."""

import os
import resource
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from protocols.uart_capture import UartAction, capture_header, read_capture
from service.recording.uart_recorder import UartRecorder
from service.settings import SettingsError


def test_a_truncated_capture_is_appended_to(tmp_path: Path) -> None:
    path = tmp_path / "naze.uart"
    for number in range(3):
        recorder = UartRecorder(path)
        recorder.note(UartAction.READ, 115200, bytes((number,)))
        recorder.close()
        with path.open("ab") as file:
            file.write(b'{"t":0.5,"ba')
    assert [found.data for found in read_capture(path.read_bytes()) if found.action is UartAction.READ] == [
        b"\0",
        b"\1",
        b"\2",
    ]


def test_a_truncated_capture_on_a_full_disk_is_refused_with_the_reason(tmp_path: Path) -> None:
    """It was truncated because the disk was full: the daemon is started again before there is space."""
    path = tmp_path / "naze.uart"
    path.write_bytes(capture_header("2026-11-21T12:00:00Z") + b'{"t":0.5,"ba')
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, hard))
    try:
        with pytest.raises(SettingsError, match=r"cannot record into .*naze\.uart: File too large; name another file"):
            UartRecorder(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_captures_total_size_is_limited(tmp_path: Path) -> None:
    path = tmp_path / "naze.uart"
    ends = 0
    for _ in range(3):
        with capture_logs() as events:
            recorder = UartRecorder(path, max_size=2000)
            for _ in range(20):
                recorder.note(UartAction.WRITE, 115200, bytes(10))
            recorder.close()
        ends += len([entry for entry in events if entry["event"] == "uart.recording_ended"])
    assert ends == 2
    assert 1900 < path.stat().st_size <= 2000
    assert path.read_bytes().endswith(b"}\n")


def test_other_files_are_not_appended_to(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("mine")
    with pytest.raises(SettingsError, match=r"notes\.txt is not a UART capture"):
        UartRecorder(path)
    assert path.read_text() == "mine"
    near, far = os.openpty()
    for no_file in (tmp_path, Path(os.ttyname(far))):
        with pytest.raises(SettingsError, match="is not a file: name a new file"):
            UartRecorder(no_file)
    os.set_blocking(near, False)
    with pytest.raises(BlockingIOError):
        os.read(near, 1)
    os.close(near)
    os.close(far)
