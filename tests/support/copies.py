# SPDX-License-Identifier: GPL-3.0-or-later
"""Run code in a copy of the process, so that one preparation serves many runs."""

from collections.abc import Callable
from multiprocessing import get_context
from typing import TypeVar

T = TypeVar("T")


def in_a_copy(work: Callable[[], T]) -> T:
    """The result of `work` in a child process forked from this one. EOFError if it raises."""
    context = get_context("fork")
    near, far = context.Pipe(duplex=False)
    child = context.Process(target=lambda: far.send(work()))
    child.start()
    far.close()
    try:
        return near.recv()  # type: ignore[no-any-return]
    finally:
        child.join()
