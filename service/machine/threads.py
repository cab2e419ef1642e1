# SPDX-License-Identifier: GPL-3.0-or-later
"""Threads alongside the event loop: the way back to it, and a thread for disks and name servers, which may hang.

The event loop and the end of the process do not wait for them. (Both wait for asyncio's own threads.)
"""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from queue import SimpleQueue
from typing import TypeVar, TypeVarTuple

import structlog

#: Questions to a thread that hangs. More are refused at once. All clients together ask fewer: 48 of the page, 8 over
#: zenoh, 16 on the control socket.
MAX_WAITING = 100

T = TypeVar("T")
Arguments = TypeVarTuple("Arguments")
_log = structlog.get_logger()


def post(loop: asyncio.AbstractEventLoop, callback: Callable[[*Arguments], object], *arguments: *Arguments) -> None:
    """Call back on the loop. Ignored if the loop has ended: zenoh, or a hanging disk, may notice that later."""
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(callback, *arguments)


class BackgroundThread:
    """Runs jobs in order. A daemon thread, so that one that hangs in the kernel ends with the process.

    `ask_timeout_s`: the time that a caller of `ask` waits for the disk; None: until there is an answer.
    """

    def __init__(self, name: str, ask_timeout_s: float | None = None) -> None:
        self._ask_timeout_s = ask_timeout_s
        self._work: SimpleQueue[Callable[[], object] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, work: Callable[[], object]) -> None:
        """Queue a job. An exception is logged, and the next job runs."""
        self._work.put(work)

    async def ask(self, work: Callable[[], T]) -> T:
        """Queue a job that may raise, and return the result; TimeoutError. Called on an event loop."""
        answer: Future[T] = Future()

        def run() -> None:
            if answer.set_running_or_notify_cancel():  # the asker still waits
                try:
                    answer.set_result(work())
                except Exception as error:
                    answer.set_exception(error)

        try:
            if self._work.qsize() >= MAX_WAITING:
                raise TimeoutError
            self.submit(run)
            async with asyncio.timeout(self._ask_timeout_s):
                return await asyncio.wrap_future(answer)
        except TimeoutError:
            raise TimeoutError("the disk does not answer in time: it is busy or failing; check dmesg") from None

    def close(self, timeout_s: float) -> bool:
        """Run the remaining jobs and end. Returns False on timeout."""
        self._work.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            try:
                work()
            except Exception:
                _log.exception("daemon.fault", what=f"a job of the thread {self._thread.name}")
