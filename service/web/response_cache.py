# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of long responses, made in a thread, one at a time.

That thread holds the interpreter for some milliseconds. So there is a pause after each response, however many
connections ask for one, so that the loop can serve the links.
"""

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable

#: The last upload, which each open page shows, and a few that are being looked at.
_KEPT = 8
_PAUSE_S = 0.05


class ResponseCache:
    """Caches responses that are final."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._kept: OrderedDict[str, str] = OrderedDict()

    async def get(self, question: str, make: Callable[[], Awaitable[tuple[str, bool]]]) -> str:
        """The response; `make` returns it, and True if it is final."""
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
