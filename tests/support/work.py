# SPDX-License-Identifier: GPL-3.0-or-later
"""The work on an event loop, counted instead of timed: bytecode instructions, and calls of C functions."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

#: 50 ms on a machine that takes 80 ns for each: eight times as long as the one that this was measured on.
LOOP_BUDGET = 600_000
_ROOT = f"{Path(__file__).parents[2]}/"
#: Where a step of the loop begins. The tests and the simulated boards share the loop.
_AROUND = ("/asyncio/", "/selectors.py", "/service/machine/event_loop.py", f"{_ROOT}tests/", f"{_ROOT}simulator/")


@dataclass(slots=True)
class Work:
    """The steps of the loop: the function that each began with, and what it cost. `worst`: per function."""

    worst: dict[str, int] = field(default_factory=dict)
    _depth: int = 0
    _begin: str = ""
    _count: int = 0

    @property
    def most(self) -> int:
        return max(self.worst.values(), default=0)

    def trace(self, frame: FrameType, event: str, _argument: Any) -> Any:
        """For sys.settrace: count instructions, but not of what the tests and the simulated boards do on their own."""
        if not self._depth and _is_around(frame.f_code):
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        self._count += event == "opcode"
        return self.trace

    def profile(self, frame: FrameType, event: str, _argument: object) -> None:
        """For sys.setprofile: count calls of C functions, and see where a step begins and ends."""
        if event == "c_call":
            self._count += 1
        elif event == "call" and (self._depth or not _is_around(frame.f_code)):
            if not self._depth:
                self._begin, self._count = frame.f_code.co_qualname, 0
            self._depth += 1
        elif event == "return" and self._depth:
            self._depth -= 1
            if not self._depth:
                self.worst[self._begin] = max(self.worst.get(self._begin, 0), self._count)


@cache
def _is_around(code: CodeType) -> bool:
    return any(part in code.co_filename for part in _AROUND)


@contextmanager
def counted() -> Iterator[Work]:
    """Count the work of each step of the loop on this thread."""
    work = Work()
    sys.settrace(work.trace)
    sys.setprofile(work.profile)
    try:
        yield work
    finally:
        sys.setprofile(None)
        sys.settrace(None)


def work(call: Callable[[], object]) -> int:
    """The work of one call."""
    with counted() as found:
        call()
    return found.most
