# SPDX-License-Identifier: GPL-3.0-or-later
"""A thread for work on a disk that may hang: neither the event loop nor the end of the process waits for it."""

import threading
from collections.abc import Callable
from queue import SimpleQueue


class DiskThread:
    """Runs jobs in order. A daemon thread, so that one that hangs in the kernel ends with the process."""

    def __init__(self, name: str) -> None:
        self._work: SimpleQueue[Callable[[], object] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, work: Callable[[], object]) -> None:
        """Queue a job, which must not raise."""
        self._work.put(work)

    def close(self, timeout_s: float) -> bool:
        """Run the remaining jobs and end; False on timeout."""
        self._work.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            work()
