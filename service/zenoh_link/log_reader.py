# SPDX-License-Identifier: GPL-3.0-or-later
"""Searches the telemetry logs for queries, one at a time: equal queries share a search, others wait in turn."""

import asyncio
import time
from collections.abc import Hashable
from contextlib import suppress
from math import inf
from pathlib import Path

from service.machine.threads import BackgroundThread
from service.zenoh_link.logged_past import LoggedPast, log_stamps, read_logged_past
from service.zenoh_link.time_range import TimeRange

#: A zenoh query waits for 10 s.
_TIMEOUT_S = 8.0
_SEARCH_S = 5.0
#: While other queries wait: eight are answered in the time of one.
_SHARED_SEARCH_S = _SEARCH_S / 8
#: A search ends this long before its query's timeout, or is not begun.
_SPARE_S = 1.0
_BUSY = "other queries about the past are being answered: ask for less, or try again in some seconds"


class LogReader:
    """Searches the logs in `folder` on a thread."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._earlier = frozenset[str]()
        with suppress(OSError):  # a query reports it
            self._earlier = log_stamps(folder)
        self._disk = BackgroundThread("history", _TIMEOUT_S)
        self._searches: dict[Hashable, asyncio.Task[LoggedPast]] = {}
        self._begun_at = -inf

    async def search(self, query: Hashable, wanted: TimeRange, max_positions: int, kept_from_s: float) -> LoggedPast:
        """See read_logged_past. OSError; TimeoutError if the disk hangs, or if other queries take all the time.

        `query`: equal ones get the result of one search.
        """
        search = self._searches.get(query)
        if search is None:
            search = asyncio.create_task(self._search(wanted, max_positions, kept_from_s))
            self._searches[query] = search
            search.add_done_callback(lambda _: self._searches.pop(query))
        return await asyncio.shield(search)

    async def _search(self, wanted: TimeRange, max_positions: int, kept_from_s: float) -> LoggedPast:
        ends_at = time.monotonic() + _TIMEOUT_S - _SPARE_S
        is_begun = False

        def search() -> LoggedPast:
            nonlocal is_begun
            begun_at = time.monotonic()
            if begun_at >= ends_at:
                raise TimeoutError(_BUSY)
            is_begun, self._begun_at = True, begun_at

            def is_enough() -> bool:
                search_s = _SHARED_SEARCH_S if len(self._searches) > 1 else _SEARCH_S
                return time.monotonic() > min(begun_at + search_s, ends_at)

            return read_logged_past(self._folder, wanted, max_positions, self._earlier, kept_from_s, is_enough)

        try:
            return await self._disk.ask(search)
        except TimeoutError as error:
            is_hung = is_begun or time.monotonic() - self._begun_at > _SEARCH_S + _SPARE_S
            raise TimeoutError(str(error) if is_hung else _BUSY) from None
