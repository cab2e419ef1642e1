# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on a disk that hangs."""

import asyncio
import threading

import pytest
from structlog.testing import capture_logs

from service.machine.threads import BackgroundThread


def test_work_is_done_in_order_before_the_end() -> None:
    done: list[int] = []
    thread = BackgroundThread("test")
    for number in range(100):
        thread.submit(lambda number=number: done.append(number))  # type: ignore[misc]
    assert thread.close(timeout_s=10)
    assert done == list(range(100))


def test_the_end_does_not_wait_for_a_hung_disk() -> None:
    hangs = threading.Event()
    thread = BackgroundThread("test")
    thread.submit(hangs.wait)
    assert not thread.close(timeout_s=0.05)
    hangs.set()
    assert thread.close(timeout_s=10)


async def test_a_question_gets_the_answer_or_the_error() -> None:
    thread = BackgroundThread("test")
    assert await thread.ask(lambda: 7) == 7
    with pytest.raises(ZeroDivisionError):
        await thread.ask(lambda: 1 / 0)
    thread.close(timeout_s=10)


async def test_a_cancelled_question_does_not_end_the_thread() -> None:
    hangs = threading.Event()
    thread = BackgroundThread("test")
    for _ in range(2):  # one runs, one waits
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(thread.ask(hangs.wait), 0.01)
    hangs.set()
    assert await thread.ask(lambda: 7) == 7
    thread.close(timeout_s=10)


async def test_questions_to_a_hung_disk_end_in_time_and_do_not_pile_up() -> None:
    hangs = threading.Event()
    thread = BackgroundThread("test", ask_timeout_s=0.001)
    for _ in range(200):
        with pytest.raises(TimeoutError, match="the disk does not answer"):
            await thread.ask(hangs.wait)
    assert thread._work.qsize() == 100
    hangs.set()
    assert thread.close(timeout_s=10)


async def test_a_job_that_raises_does_not_end_the_thread() -> None:
    thread = BackgroundThread("test")
    with capture_logs() as events:
        thread.submit(lambda: 1 / 0)
        assert await thread.ask(lambda: 7) == 7
    assert [(event["event"], event["log_level"]) for event in events] == [("daemon.fault", "error")]
    thread.close(timeout_s=10)
