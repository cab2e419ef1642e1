# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's event loop, with a fast lane for the flight controller's port and the bridge's timer."""

import asyncio
import select
import selectors
from collections.abc import Callable, Coroutine, Sequence
from contextvars import Context
from math import inf
from time import monotonic
from typing import Any, TypeVar, TypeVarTuple

_Call = Callable[[float], None]
_Wait = Callable[[Sequence[int], tuple[()], tuple[()], float | None], tuple[Sequence[int], object, object]]
T = TypeVar("T")
_Ts = TypeVarTuple("_Ts")


class FastLane:
    """One descriptor and one timer, whose calls are made where the loop waits. They get the present time.

    A turn of asyncio takes more time than the work of such a call, because the caches are cold. A turn follows if the
    call asks for one, for example with `call_soon`.
    """

    def __init__(self) -> None:
        self._port = select.epoll()
        #: The descriptor that is readable when the port is: its number is low enough for select.
        self.descriptor = self._port.fileno()
        self._watched = -1
        self.on_readable: _Call | None = None
        self.on_timer: _Call | None = None
        self.timer_at = inf
        #: Until then the port is not polled; at that time it is read without polling.
        self.held_until = -inf

    def watch(self, descriptor: int, on_readable: _Call) -> None:
        """Call each time the port is readable, until `unwatch`. After a hold there may be no data."""
        assert self.on_readable is None, "the lane has one port"
        self._port.register(descriptor, select.EPOLLIN)
        self._watched, self.on_readable = descriptor, on_readable

    def unwatch(self) -> None:
        """Stop watching the port. The descriptor must still be open."""
        if self.on_readable is not None:
            self._port.unregister(self._watched)
            self.on_readable, self.held_until = None, -inf

    def hold(self, until: float) -> None:
        """Do not read before this time: too little will have arrived to be worth a wake-up."""
        self.held_until = until

    def set_timer(self, at: float, call: _Call) -> None:
        """Make a call at that time. It replaces the timer that was set before."""
        self.timer_at, self.on_timer = at, call

    def stop_timer(self) -> None:
        self.timer_at, self.on_timer = inf, None

    def close(self) -> None:
        self._port.close()


class EventLoop(asyncio.SelectorEventLoop):
    """asyncio's loop, and its fast lane."""

    def __init__(self, selector: "LaneSelector | None" = None) -> None:
        self._waiting = selector or LaneSelector()
        self._waiting.on_error = self._failed
        #: Serves the flight controller.
        self.lane = self._waiting.lane
        super().__init__(self._waiting)

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

    def _failed(self, call: _Call, error: Exception) -> None:
        handle = asyncio.Handle(call, (), self)
        self.call_exception_handler({"message": "Exception in the fast lane", "exception": error, "handle": handle})


class LaneSelector(selectors.EpollSelector):
    """Waits for the loop's events, and meanwhile serves the fast lane. `time` and `wait` are replaced in tests."""

    def __init__(self, time: Callable[[], float] = monotonic, wait: _Wait = select.select) -> None:
        super().__init__()
        self.lane = FastLane()
        self.on_error: Callable[[_Call, Exception], None]
        #: A call has given the loop something to do.
        self.has_work = False
        self._time = time
        #: Exact: epoll's own timeout is in whole ms.
        self._wait = wait
        #: Readable when the loop has events.
        self._events = self.fileno()
        self._only_events, self._all = (self._events,), (self._events, self.lane.descriptor)

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        lane, now = self.lane, self._time()
        end = inf if timeout is None else now + timeout
        self.has_work = False
        while True:
            is_held = now < lane.held_until
            until = min(end, lane.timer_at, lane.held_until if is_held else inf)
            watched = self._only_events if is_held else self._all
            ready, _, _ = self._wait(watched, (), (), None if until == inf else max(until - now, 0.0))
            now = self._time()
            if lane.descriptor in ready or (is_held and now >= lane.held_until):
                self._call(lane.on_readable, now)
            if now >= lane.timer_at:
                lane.timer_at = inf
                self._call(lane.on_timer, now)
            if self._events in ready:
                return super().select(0)
            if self.has_work or now >= end:
                return []

    def close(self) -> None:
        self.lane.close()
        super().close()

    def _call(self, call: _Call | None, now: float) -> None:
        if call is not None:
            try:
                call(now)
            except Exception as error:
                self.on_error(call, error)


def running() -> EventLoop:
    """The loop that this call runs on."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, EventLoop)
    return loop


def run(main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine on a new event loop, as asyncio.run does."""
    with asyncio.Runner(loop_factory=EventLoop) as runner:
        return runner.run(main)
