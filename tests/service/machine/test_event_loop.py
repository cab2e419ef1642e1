# SPDX-License-Identifier: GPL-3.0-or-later
"""The fast lane beside everything else that the event loop does."""

import asyncio
import os
import socket
import threading
from collections.abc import Iterator, Sequence
from math import inf
from typing import Any

import pytest

from service.machine.event_loop import EventLoop, LaneSelector, run, running
from tests.support.programs import TIMEOUT_S, until_async

INTERVAL_S = 0.001
HOUR_S = 3600.0


@pytest.fixture
def loop() -> Iterator[EventLoop]:
    loop = EventLoop()
    yield loop
    loop.close()


class Port:
    """A pipe whose reading end is in the fast lane; `reads`: the data, and when it was read."""

    def __init__(self, loop: EventLoop) -> None:
        self.loop = loop
        self.reads: list[tuple[bytes, float]] = []
        self._near, self._far = os.pipe()
        os.set_blocking(self._near, False)
        loop.lane.watch(self._near, self._read)

    def write(self, data: bytes) -> None:
        os.write(self._far, data)

    def close(self) -> None:
        self.loop.lane.unwatch()
        os.close(self._near)
        os.close(self._far)

    def _read(self, now: float) -> None:
        try:
            data = os.read(self._near, 100)
        except BlockingIOError:
            data = b""
        self.reads.append((data, now))


@pytest.fixture
async def port() -> Any:
    port = Port(running())
    yield port
    port.close()


async def test_a_timer_fires_once_and_not_early() -> None:
    loop = running()
    times: list[float] = []
    at = loop.time() + 5 * INTERVAL_S
    loop.lane.set_timer(loop.time() + HOUR_S, lambda _: times.append(0.0))
    loop.lane.set_timer(at, times.append)
    await until_async(lambda: times, "the call")
    await asyncio.sleep(5 * INTERVAL_S)
    assert len(times) == 1
    assert times[0] >= at


async def test_a_stopped_timer_does_not_fire() -> None:
    loop = running()
    loop.lane.set_timer(loop.time() + INTERVAL_S, lambda _: pytest.fail("called"))
    loop.lane.stop_timer()
    assert loop.lane.timer_at == inf  # the watchdog looks at it
    await asyncio.sleep(5 * INTERVAL_S)


async def test_data_is_read_on_arrival(port: Port) -> None:
    for number in range(3):
        port.write(b"%d" % number)
        await until_async(lambda number=number: len(port.reads) > number, "the data")  # type: ignore[misc]
    assert [data for data, _ in port.reads] == [b"0", b"1", b"2"]


async def test_held_data_is_read_together_once_the_time_has_come(port: Port) -> None:
    port.loop.lane.hold(port.loop.time() + HOUR_S)
    port.write(b"a")
    await asyncio.sleep(INTERVAL_S)
    port.write(b"b")
    until = port.loop.time() + 20 * INTERVAL_S
    port.loop.lane.hold(until)
    await until_async(lambda: port.reads, "the data")
    data, read_at = port.reads[0]
    assert data == b"ab"
    assert read_at >= until


async def test_after_a_hold_without_data_the_next_data_is_read_on_arrival(port: Port) -> None:
    port.loop.lane.hold(port.loop.time() + INTERVAL_S)
    await asyncio.sleep(2 * INTERVAL_S)
    port.write(b"late")
    await until_async(lambda: b"late" in [data for data, _ in port.reads], "the data")


async def test_a_hold_can_end_early(port: Port) -> None:
    port.loop.lane.hold(port.loop.time() + HOUR_S)
    port.write(b"data")
    await asyncio.sleep(INTERVAL_S)
    assert port.reads == []
    port.loop.lane.hold(port.loop.time())
    await until_async(lambda: port.reads, "the data")


@pytest.mark.parametrize("how", ["call_soon", "call_later", "call_soon_threadsafe"])
def test_the_loop_runs_new_callbacks_at_once(loop: EventLoop, how: str) -> None:
    """Otherwise it would wait for its next timer, an hour away."""

    def ask(now: float) -> None:
        loop.lane.set_timer(now + INTERVAL_S, lambda _: None)
        if how == "call_soon_threadsafe":
            threading.Thread(target=loop.call_soon_threadsafe, args=(done,)).start()
        elif how == "call_later":
            loop.call_later(INTERVAL_S, done)
        else:
            loop.call_soon(done)

    def done() -> None:
        loop.stop()

    loop.call_later(HOUR_S, done)
    loop.lane.set_timer(loop.time() + INTERVAL_S, ask)
    loop.run_forever()


async def test_descriptors_and_timers_are_served_despite_a_busy_lane() -> None:
    loop = running()
    near, far = socket.socketpair()
    served: list[str] = []

    def readable() -> None:
        served.append(near.recv(10).decode())

    def again(now: float) -> None:
        loop.lane.set_timer(now, again)

    loop.add_reader(near, readable)
    again(loop.time())
    loop.call_later(INTERVAL_S, served.append, "timer")
    loop.call_later(2 * INTERVAL_S, far.send, b"data")
    await until_async(lambda: served == ["timer", "data"], "both")
    loop.remove_reader(near)
    loop.lane.stop_timer()
    near.close()
    far.close()


async def test_the_lane_is_served_despite_a_busy_loop(port: Port) -> None:
    called: list[float] = []
    port.loop.lane.set_timer(port.loop.time() + INTERVAL_S, called.append)
    port.write(b"data")
    async with asyncio.timeout(TIMEOUT_S):
        while not (called and port.reads):  # noqa: ASYNC110 (no wait: always another turn)
            await asyncio.sleep(0)


async def test_an_error_is_reported_with_the_handle(port: Port) -> None:
    """The daemon restarts the flight controller's line then."""
    reported: list[dict[str, Any]] = []
    port.loop.set_exception_handler(lambda _, context: reported.append(context))

    def fail(_now: float) -> None:
        raise ZeroDivisionError

    port.loop.lane.set_timer(port.loop.time(), fail)
    await until_async(lambda: reported, "the report")
    port.write(b"data")
    await until_async(lambda: port.reads, "the data")
    assert isinstance(reported[0]["exception"], ZeroDivisionError)
    assert reported[0]["handle"]


def test_a_coroutine_runs_on_a_loop_with_a_lane() -> None:
    async def main() -> int:
        return running().lane.descriptor

    descriptor = run(main())
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(descriptor)


class Waiting:
    """A selector in simulated time, and what its lane does. `readable_at`: when the port becomes readable."""

    def __init__(self, *readable_at: float) -> None:
        self.now = 0.0
        self.waits = 0
        self.reads: list[float] = []
        self.ticks: list[float] = []
        self._readable_at = [*readable_at]
        self._port, self._far = os.pipe()
        self.selector = LaneSelector(lambda: self.now, self._wait)
        self.lane = self.selector.lane
        self.lane.watch(self._port, self._read)

    def close(self) -> None:
        self.selector.close()
        os.close(self._port)
        os.close(self._far)

    def _read(self, now: float) -> None:
        self.reads.append(now)
        self._readable_at = [at for at in self._readable_at if at > now]

    def _wait(
        self, descriptors: Sequence[int], _writers: object, _others: object, seconds: float | None
    ) -> tuple[Sequence[int], object, object]:
        self.waits += 1
        assert seconds is not None
        watched_until = self.now + seconds
        if self.lane.descriptor in descriptors and self._readable_at and self._readable_at[0] <= watched_until:
            self.now = max(self.now, self._readable_at[0])
            return [self.lane.descriptor], (), ()
        self.now = watched_until
        return [], (), ()


@pytest.fixture
def waiting(request: pytest.FixtureRequest) -> Iterator[Waiting]:
    waiting = Waiting(*request.param)
    yield waiting
    waiting.close()


@pytest.mark.parametrize("waiting", [(0.1, 0.2, 3.0)], indirect=True)
def test_a_hold_ends_at_the_time_and_the_timer_is_not_early(waiting: Waiting) -> None:
    waiting.lane.hold(1.0)
    waiting.lane.set_timer(4.0, waiting.ticks.append)
    assert waiting.selector.select(5.0) == []
    assert waiting.reads == [1.0, 3.0]
    assert waiting.ticks == [4.0]
    assert waiting.now == 5.0


@pytest.mark.parametrize("waiting", [(1.0, 2.0)], indirect=True)
def test_earlier_callbacks_do_not_cost_a_turn(waiting: Waiting) -> None:
    waiting.selector.has_work = True
    assert waiting.selector.select(5.0) == []
    assert waiting.now == 5.0
    assert waiting.waits == 3


@pytest.mark.parametrize("waiting", [(0.1,)], indirect=True)
def test_a_port_that_was_held_is_closed_with_the_hold(waiting: Waiting) -> None:
    waiting.lane.hold(3.0)
    waiting.lane.unwatch()
    waiting.lane.watch(waiting._port, waiting._read)
    waiting.selector.select(1.0)
    assert waiting.reads == [0.1]
