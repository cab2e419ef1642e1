# SPDX-License-Identifier: GPL-3.0-or-later
"""Records from the event loop to a slow disk, through a thread: the loop never waits."""

import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

import structlog

#: The maximum loss if the process is killed.
_FLUSH_S = 1.0
#: For the last write: a hanging disk must not keep the daemon from ending.
_CLOSE_TIMEOUT_S = 1.0
#: Bytes beyond this are dropped while an SD card stalls: minutes of telemetry, 90 s of a full UART at 115200.
#: (Telemetry takes six times as much memory while it waits.)
_MAX_WAITING = 1 << 20

_log = structlog.get_logger()

T = TypeVar("T")


class DiskWriter(Generic[T]):
    """Calls `write` on its thread once a second, with the records from `put`. `on_end` is called after the last."""

    def __init__(self, name: str, write: Callable[[list[T]], None], on_end: Callable[[], None]) -> None:
        self._name = name
        self._write = write
        self._on_end = on_end
        # Without a lock: `put` only appends and adds, the thread only removes.
        self._waiting: deque[tuple[T, int]] = deque()
        self._size_put = self._size_taken = 0
        self._ending = threading.Event()
        #: Bytes dropped because too many were waiting.
        self.dropped = 0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, record: T, size: int) -> None:
        """Queue a record of `size` bytes, or drop it if too many are waiting."""
        if self._size_put - self._size_taken + size <= _MAX_WAITING:
            self._waiting.append((record, size))
            self._size_put += size
            return
        if not self.dropped:
            _log.warning("disk.too_slow", writing=self._name, why="the disk does not keep up; some data is dropped")
        self.dropped += size

    def close(self) -> None:
        """Write the rest, then end the thread."""
        self._ending.set()
        self._thread.join(_CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        while not self._ending.wait(_FLUSH_S):
            self._flush()
        self._flush()
        self._on_end()

    def _flush(self) -> None:
        taken = [self._waiting.popleft() for _ in range(len(self._waiting))]
        self._size_taken += sum(size for _, size in taken)
        try:
            self._write([record for record, _ in taken])
        except Exception:  # a bug must not end the recording
            _log.exception("daemon.fault", what=f"writing the {self._name}")
