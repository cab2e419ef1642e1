# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes from the event loop to a slow disk, through a thread: the loop never waits."""

import threading
from collections.abc import Callable

import structlog

#: The maximum loss if the process is killed.
_FLUSH_S = 1.0
#: For the last write: a hanging disk must not keep the daemon from ending.
_CLOSE_TIMEOUT_S = 1.0
#: Bytes beyond this are dropped while an SD card stalls: minutes of telemetry, 90 s of a full UART at 115200.
_MAX_WAITING = 1 << 20

_log = structlog.get_logger()


class DiskWriter:
    """Calls `write` on its thread once a second, with the bytes from `put`.

    `lock` guards the bytes. `on_take` is called with it held, when bytes are taken: bytes put after that go into the
    next `write`. `on_end` is called after the last `write`.
    """

    def __init__(
        self,
        name: str,
        write: Callable[[bytes], None],
        on_end: Callable[[], None],
        on_take: Callable[[], None] = lambda: None,
    ) -> None:
        self._name = name
        self._write = write
        self._on_end = on_end
        self._on_take = on_take
        self._waiting = bytearray()
        self._ending = threading.Event()
        self.lock = threading.Lock()
        #: Bytes dropped because too many were waiting.
        self.dropped = 0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, data: bytes) -> None:
        """Queue bytes, or drop them if too many are waiting. Hold `lock`."""
        if len(self._waiting) + len(data) <= _MAX_WAITING:
            self._waiting += data
            return
        if not self.dropped:
            _log.warning("disk.too_slow", writing=self._name, why="the disk does not keep up; some data is dropped")
        self.dropped += len(data)

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
        with self.lock:
            data, self._waiting = self._waiting, bytearray()
            self._on_take()
        self._write(bytes(data))
