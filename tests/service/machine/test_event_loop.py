# SPDX-License-Identifier: GPL-3.0-or-later
"""A repeated call beside everything else that the event loop does."""

import asyncio
import socket
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from service.machine.event_loop import EventLoop
from tests.support.programs import TIMEOUT_S, until_async

INTERVAL_S = 0.001
HOUR_S = 3600.0


@pytest.fixture
def loop() -> Iterator[EventLoop]:
    loop = EventLoop()
    yield loop
    loop.close()


def running() -> EventLoop:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, EventLoop)
    return loop


async def test_a_call_is_repeated_at_its_interval_until_it_is_stopped() -> None:
    loop = running()
    times: list[float] = []

    def note(now: float) -> None:
        times.append(now)
        if len(times) == 20:
            loop.stop_repeating()
            loop.call_soon(done.set_result, None)

    done = loop.create_future()
    loop.repeat(INTERVAL_S, note)
    began = loop.time()
    async with asyncio.timeout(TIMEOUT_S):
        await done
    await asyncio.sleep(5 * INTERVAL_S)
    assert len(times) == 20
    assert all(later - earlier >= INTERVAL_S for earlier, later in zip([began, *times], times, strict=False))


async def test_a_later_call_replaces_an_earlier_one() -> None:
    loop = running()
    called: list[str] = []
    loop.repeat(INTERVAL_S, lambda _: called.append("first"))
    loop.repeat(INTERVAL_S, lambda _: called.append("second"))
    await until_async(lambda: len(called) > 3, "the calls")
    loop.stop_repeating()
    assert set(called) == {"second"}


@pytest.mark.parametrize("how", ["call_soon", "call_later", "call_soon_threadsafe"])
def test_the_loop_does_at_once_what_a_repeated_call_asks_of_it(loop: EventLoop, how: str) -> None:
    """Otherwise it would wait for its next timer, an hour away."""

    def ask(_now: float) -> None:
        if how == "call_soon_threadsafe":
            threading.Thread(target=loop.call_soon_threadsafe, args=(done,)).start()
        elif how == "call_later":
            loop.call_later(INTERVAL_S, done)
        else:
            loop.call_soon(done)

    def done() -> None:
        loop.stop()

    loop.call_later(HOUR_S, done)
    loop.repeat(INTERVAL_S, ask)
    loop.run_forever()


async def test_descriptors_and_timers_are_served_meanwhile() -> None:
    loop = running()
    near, far = socket.socketpair()
    served: list[str] = []

    def readable() -> None:
        served.append(near.recv(10).decode())

    loop.add_reader(near, readable)
    loop.repeat(HOUR_S, lambda _: served.append("never"))
    loop.call_later(INTERVAL_S, served.append, "timer")
    loop.call_later(2 * INTERVAL_S, far.send, b"data")
    await until_async(lambda: served == ["timer", "data"], "both")
    loop.remove_reader(near)
    loop.stop_repeating()
    near.close()
    far.close()


async def test_an_error_in_a_repeated_call_is_reported_and_the_call_is_repeated() -> None:
    loop = running()
    reported: list[dict[str, Any]] = []
    loop.set_exception_handler(lambda _, context: reported.append(context))
    called: list[float] = []

    def fail(now: float) -> None:
        called.append(now)
        raise ZeroDivisionError

    loop.repeat(INTERVAL_S, fail)
    await until_async(lambda: len(called) > 2, "the repetition")
    loop.stop_repeating()
    assert isinstance(reported[0]["exception"], ZeroDivisionError)
    assert reported[0]["handle"]


async def test_an_overdue_call_is_made_at_once() -> None:
    """After a long turn of the loop."""
    loop = running()
    called: list[float] = []
    loop.repeat(INTERVAL_S, called.append)
    threading.Event().wait(5 * INTERVAL_S)
    await until_async(lambda: called, "the call")
    loop.stop_repeating()
