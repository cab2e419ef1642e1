# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers of hundreds of items: made beside the loop that serves the links, one at a time, and not twice.

A thread that computes holds the interpreter for some milliseconds. Whoever asks for one such answer after the other,
from however many connections, gets them with a pause in between, in which the links have the processor to themselves.
"""

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable

#: So many are kept: the last upload, which each open page asks for, and what is looked at beside it.
_KEPT = 8
_PAUSE_S = 0.05


class KeptAnswers:
    """Remembers answers that will never change."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._kept: OrderedDict[str, str] = OrderedDict()

    async def get(self, question: str, make: Callable[[], Awaitable[tuple[str, bool]]]) -> str:
        """Return the answer; `make` returns it, and whether it is for good."""
        async with self._turn:
            answer = self._kept.get(question)
            if answer is None:
                answer, is_final = await make()
                if is_final:
                    self._kept[question] = answer
                    while len(self._kept) > _KEPT:
                        self._kept.popitem(last=False)
                await asyncio.sleep(_PAUSE_S)
        return answer
