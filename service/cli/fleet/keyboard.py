# SPDX-License-Identifier: GPL-3.0-or-later
"""Key presses for scrolling while something is displayed."""

import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager

#: Rows that a key scrolls; pages are scrolled by `page` rows.
_ROWS = {b"j": 1, b"\x1b[B": 1, b"k": -1, b"\x1b[A": -1}
_PAGES = {b" ": 1, b"\x1b[6~": 1, b"b": -1, b"\x1b[5~": -1}


@contextmanager
def scrolling() -> Iterator[None]:
    """Deliver keys as they are pressed, if standard input is a terminal."""
    if not sys.stdin.isatty():
        yield
        return
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def wait_for_scroll(timeout_s: float, page: int) -> int:
    """Wait for a key; the rows to scroll, 0 for none."""
    if not sys.stdin.isatty():
        select.select([], [], [], timeout_s)
        return 0
    ready, _, _ = select.select([sys.stdin], [], [], timeout_s)
    key = os.read(sys.stdin.fileno(), 16) if ready else b""
    return _ROWS.get(key, 0) + _PAGES.get(key, 0) * page
