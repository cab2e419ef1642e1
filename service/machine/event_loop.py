# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's event loop, with one repeated call that takes no turn of the loop."""

import asyncio
import selectors
from collections.abc import Callable
from contextvars import Context
from math import inf
from select import select
from time import monotonic
from typing import TypeVarTuple

_Ts = TypeVarTuple("_Ts")


class EventLoop(asyncio.SelectorEventLoop):
    """asyncio's loop, and `repeat`.

    A turn of asyncio for a timer takes more time than the work that a repeated call has, because the caches are cold.
    So the call is made where the loop waits. A turn follows if the call asks for one, for example with `call_soon`.
    """

    def __init__(self) -> None:
        self._waiting = _Selector(self._failed)
        super().__init__(self._waiting)

    def repeat(self, interval_s: float, call: Callable[[float], None]) -> None:
        """Make a call with the present time each interval, in place of an earlier one."""
        self._waiting.repeat(interval_s, call)

    def stop_repeating(self) -> None:
        self._waiting.repeated = None

    def call_soon(
        self, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.Handle:
        self._waiting.has_work = True
        return super().call_soon(callback, *args, context=context)

    def call_at(
        self, when: float, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        self._waiting.has_work = True
        return super().call_at(when, callback, *args, context=context)

    def _failed(self, call: Callable[[float], None], error: Exception) -> None:
        handle = asyncio.Handle(call, (), self)
        self.call_exception_handler({"message": "Exception in a repeated call", "exception": error, "handle": handle})


class _Selector(selectors.EpollSelector):
    def __init__(self, failed: Callable[[Callable[[float], None], Exception], None]) -> None:
        super().__init__()
        self._failed = failed
        #: The descriptor that is readable when there are events.
        self._events = [self.fileno()]
        self.repeated: Callable[[float], None] | None = None
        self._interval_s = 0.0
        self._due = inf
        #: A call has given the loop something to do.
        self.has_work = False

    def repeat(self, interval_s: float, call: Callable[[float], None]) -> None:
        self.repeated, self._interval_s, self._due = call, interval_s, monotonic() + interval_s

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if self.repeated is None:
            return super().select(timeout)
        now = monotonic()
        end = inf if timeout is None else now + timeout
        self.has_work = False
        while (repeated := self.repeated) is not None and not self.has_work and now < end:
            # Exact: epoll's timeout is in whole ms.
            ready, _, _ = select(self._events, (), (), max(0.0, min(self._due, end) - now))
            if ready:
                break
            now = monotonic()
            if now >= self._due:
                self._due = now + self._interval_s
                try:
                    repeated(now)
                except Exception as error:
                    self._failed(repeated, error)
        return super().select(0)
