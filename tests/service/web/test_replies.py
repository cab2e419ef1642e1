# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers in paths."""

import asyncio

import pytest
from starlette.exceptions import HTTPException

from service.web.replies import Turns, whole


@pytest.mark.parametrize("text", ["", "-1", "1.5", "x", "9" * 30, "2147483648", "²"])
def test_an_invalid_number_is_not_found(text: str) -> None:
    with pytest.raises(HTTPException) as caught:
        whole(text)
    assert caught.value.status_code == 404


def test_a_number_is_read() -> None:
    assert whole("2147483647") == 2147483647


async def test_long_responses_are_made_one_at_a_time() -> None:
    turns, steps = Turns(pause_s=0), list[str]()

    async def make(name: str) -> None:
        async with turns.take():
            steps.append(f"{name} begins")
            await asyncio.sleep(0)
            steps.append(f"{name} ends")

    await asyncio.gather(make("a"), make("b"))
    assert steps == ["a begins", "a ends", "b begins", "b ends"]
