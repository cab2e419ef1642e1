# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries that search the telemetry logs at the same time: shared, in turn, or refused for the true reason."""

import asyncio
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.zenoh_link import history
from service.zenoh_link.history import LogReader
from service.zenoh_link.logged_past import LoggedPast
from service.zenoh_link.time_range import TimeRange


@pytest.fixture(autouse=True)
def shorter_times(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("_TIMEOUT_S", "_SEARCH_S", "_SHARED_SEARCH_S", "_SPARE_S"):
        monkeypatch.setattr(history, name, getattr(history, name) / 4)


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[TimeRange]:
    """Searches of logs so large that they never end by themselves."""
    begun: list[TimeRange] = []

    def search(_folder: Path, wanted: TimeRange, *_: Any) -> LoggedPast:
        begun.append(wanted)
        is_enough: Callable[[], bool] = _[-1]
        while not is_enough():
            time.sleep(0.001)
        return LoggedPast(from_s=wanted.start_s)

    monkeypatch.setattr(history, "read_logged_past", search)
    return begun


async def results(reader: LogReader, starts_s: list[int]) -> list[Any]:
    asked = (reader.search(start_s, TimeRange(start_s), 0, 0.0) for start_s in starts_s)
    return await asyncio.gather(*asked, return_exceptions=True)


async def test_equal_queries_share_a_search(tmp_path: Path, searches: list[TimeRange]) -> None:
    reader = LogReader(tmp_path)
    assert [found.from_s for found in await results(reader, [7] * 8)] == [7] * 8
    assert len(searches) == 1
    assert [found.from_s for found in await results(reader, [7])] == [7]
    assert len(searches) == 2


async def test_different_queries_share_the_time(tmp_path: Path, searches: list[TimeRange]) -> None:
    assert [found.from_s for found in await results(LogReader(tmp_path), [1, 2, 3, 4])] == [1, 2, 3, 4]
    assert len(searches) == 4


async def test_a_query_that_gets_no_turn_blames_the_others_and_not_the_disk(
    tmp_path: Path, searches: list[TimeRange]
) -> None:
    found = await results(LogReader(tmp_path), list(range(100)))
    refusals = {str(each) for each in found if isinstance(each, TimeoutError)}
    assert refusals == {history._BUSY}
    assert 0 < len(searches) < 100


async def test_all_queries_to_a_hung_disk_blame_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hangs = threading.Event()
    monkeypatch.setattr(history, "read_logged_past", lambda *_: hangs.wait())
    found = await results(LogReader(tmp_path), [1, 2, 3])
    hangs.set()
    assert ["the disk does not answer" in str(each) for each in found] == [True] * 3
