# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on a copy of everything in memory, so that one preparation serves many tries."""

from collections.abc import Callable
from multiprocessing import get_context
from typing import TypeVar

T = TypeVar("T")


def in_a_copy(work: Callable[[], T]) -> T:
    """What `work` returns in a child process that is a copy of this one. EOFError if it raises."""
    context = get_context("fork")
    near, far = context.Pipe(duplex=False)
    child = context.Process(target=lambda: far.send(work()))
    child.start()
    far.close()
    try:
        return near.recv()  # type: ignore[no-any-return]
    finally:
        child.join()
