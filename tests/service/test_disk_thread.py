# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on a disk that hangs."""

import threading

from service.machine.threads import DiskThread


def test_work_is_done_in_order_before_the_end() -> None:
    done: list[int] = []
    thread = DiskThread("test")
    for number in range(100):
        thread.submit(lambda number=number: done.append(number))  # type: ignore[misc]
    assert thread.close(timeout_s=10)
    assert done == list(range(100))


def test_the_end_does_not_wait_for_a_hung_disk() -> None:
    hangs = threading.Event()
    thread = DiskThread("test")
    thread.submit(hangs.wait)
    assert not thread.close(timeout_s=0.05)
    hangs.set()
    assert thread.close(timeout_s=10)
