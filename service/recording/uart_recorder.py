# SPDX-License-Identifier: GPL-3.0-or-later
"""Records the traffic on the flight controller's port (`run --record-uart FILE`), so that it can be replayed."""

import os
import time
from datetime import UTC, datetime
from pathlib import Path

import structlog

from protocols.uart_capture import UartAction, UartEvent, capture_header, capture_line, is_capture
from service.recording.disk_writer import DiskWriter
from service.settings import SettingsError
from storage.os_error import reason

#: Bytes per file: hours of telemetry, or 45 minutes of a full line at 115200 baud.
_MAX_SIZE = 64 << 20

_log = structlog.get_logger()


class UartRecorder:
    """Appends to a capture file up to a maximum size. SettingsError if the file cannot be used."""

    def __init__(self, path: Path, max_size: int = _MAX_SIZE) -> None:
        self._path = path
        self._max_size = max_size
        self._descriptor, self._size = _open(path)
        self._began_at = time.monotonic()
        self._over_because = ""
        self._writer = DiskWriter("UART capture", self._write, lambda: os.close(self._descriptor))
        started = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        self._put(capture_header(started))

    def note(self, action: UartAction, speed: int | None, data: bytes = b"", text: str = "") -> None:
        if not self._over_because:
            self._put(capture_line(UartEvent(time.monotonic() - self._began_at, speed, action, data, text)))

    def describe(self) -> str:
        """The file in use, or the reason why recording stopped, for the status."""
        ended = f", ended: {self._over_because}" if self._over_because else ""
        dropped = f", {self._writer.dropped} bytes dropped" if self._writer.dropped else ""
        return f"UART capture: {self._path}, {self._size / 1e6:.1f} of {self._max_size / 1e6:.0f} MB{dropped}{ended}"

    def close(self) -> None:
        self._writer.close()

    def _put(self, line: bytes) -> None:
        if self._size + len(line) > self._max_size:
            self._end(f"it has {self._size >> 20} MB, the maximum")
            return
        self._size += len(line)
        self._writer.put(line, len(line))

    def _write(self, lines: list[bytes]) -> None:
        if not lines:
            return
        view = memoryview(b"".join(lines))
        try:
            while view:
                view = view[os.write(self._descriptor, view) :]
            os.fdatasync(self._descriptor)
        except OSError as error:
            self._end(reason(error))

    def _end(self, why: str) -> None:
        if self._over_because:
            return
        self._over_because = why
        _log.warning("uart.recording_ended", file=str(self._path), why=why)


def _open(path: Path) -> tuple[int, int]:
    """Open a new capture, or an earlier one to append to; returns its descriptor and size."""
    try:
        if path.exists() and not path.is_file():
            # Never write to a device: a serial port may lead to an aircraft.
            raise SettingsError(f"{path} is not a file: name a new file for --record-uart")
        descriptor = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        size = os.fstat(descriptor).st_size
        if size and not is_capture(os.pread(descriptor, 64, 0)):
            raise SettingsError(f"{path} is not a UART capture: name a new file for --record-uart")
        if size and os.pread(descriptor, 1, size - 1) != b"\n":
            # The daemon was killed in the middle of a line: keep the next one apart.
            os.write(descriptor, b"\n")
    except OSError as error:
        raise SettingsError(f"cannot record into {path}: {reason(error)}; name another file") from error
    return descriptor, size
