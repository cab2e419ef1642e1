# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on a disk that hangs."""

import threading

from service.machine.threads import DiskThread


def test_work_is_done_in_order_and_waited_for() -> None:
    done: list[int] = []
    thread = DiskThread("test")
    for number in range(100):
        thread.submit(lambda number=number: done.append(number))  # type: ignore[misc]
    assert thread.close(timeout_s=10)
    assert done == list(range(100))


def test_a_disk_that_hangs_is_not_waited_for() -> None:
    hangs = threading.Event()
    thread = DiskThread("test")
    thread.submit(hangs.wait)
    assert not thread.close(timeout_s=0.05)
    hangs.set()
    assert thread.close(timeout_s=10)
