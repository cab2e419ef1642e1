# SPDX-License-Identifier: GPL-3.0-or-later
"""Large responses are computed one at a time, and only once unless they may still change."""

import asyncio

from service.web.replies import ResponseCache


class _Maker:
    """Computes responses and counts simultaneous ones."""

    def __init__(self, *, is_final: bool) -> None:
        self.made = 0
        self.at_once = 0
        self._is_final = is_final
        self._making = 0

    async def make(self) -> tuple[str, bool]:
        self._making += 1
        self.at_once = max(self.at_once, self._making)
        await asyncio.sleep(0)
        self._making -= 1
        self.made += 1
        return f"answer {self.made}", self._is_final


async def test_a_final_response_is_computed_once() -> None:
    cache, maker = ResponseCache(), _Maker(is_final=True)
    answers = await asyncio.gather(*(cache.get("1", maker.make) for _ in range(5)))
    assert answers == ["answer 1"] * 5
    for other in range(2, 12):
        await cache.get(str(other), maker.make)
    assert await cache.get("1", maker.make) == "answer 12"  # but not cached forever


async def test_a_changing_response_is_computed_each_time_one_at_a_time() -> None:
    cache, maker = ResponseCache(), _Maker(is_final=False)
    answers = await asyncio.gather(*(cache.get(str(number % 2), maker.make) for number in range(4)))
    assert sorted(answers) == [f"answer {number}" for number in range(1, 5)]
    assert maker.at_once == 1
