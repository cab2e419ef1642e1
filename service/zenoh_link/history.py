# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers `history?_time=[..]`: events of this run, earlier ones from telemetry logs, and missions from the store."""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Hashable
from contextlib import suppress
from math import inf
from pathlib import Path

from payloads.mission_data import Json
from service.daemon.api import DaemonApi
from service.machine.threads import BackgroundThread
from service.zenoh_link.logged_past import LoggedPast, log_stamps, read_logged_past
from service.zenoh_link.time_range import TimeRange, parse_time_range

#: About 150 bytes each; a busy day has some hundred.
_MAX_EVENTS = 2000
_MAX_MISSIONS = 200
_DEFAULT_RANGE = "[now(-1h)..]"
#: A zenoh query waits for 10 s.
_TIMEOUT_S = 8.0
_SEARCH_S = 5.0
#: While other queries wait: eight are answered in the time of one.
_SHARED_SEARCH_S = _SEARCH_S / 8
#: A search ends this long before its query's timeout, or is not started.
_SPARE_S = 1.0
_BUSY = "other queries about the past are being answered: ask for less, or try again in some seconds"


class History:
    """Keeps the newest events. Missions and telemetry logs (in the folder `logs`) are read on request."""

    def __init__(self, api: DaemonApi, logs: Path | None, clock: Callable[[], float]) -> None:
        self._api = api
        self._logs = None if logs is None else LogReader(logs)
        self._clock = clock
        self._events: deque[Json] = deque(maxlen=_MAX_EVENTS)

    def add(self, event: Json) -> None:
        """Keep an event's payload, including its envelope."""
        self._events.append(event)

    async def answer(self, time_range: str | None, max_positions: int) -> Json:
        """The events, missions and positions of a time range; StoreError, OSError, or ValueError about the range."""
        time_range = time_range or _DEFAULT_RANGE
        wanted = parse_time_range(time_range, self._clock())
        found = await self._api.missions_between(wanted.start_s, wanted.end_s, _MAX_MISSIONS)
        # Not simply the first one's: the clock may have been set back since.
        kept_from_s = min((event["time_s"] for event in self._events), default=inf)
        logged = LoggedPast()
        if self._logs is not None:
            logged = await self._logs.search((time_range, max_positions), wanted, max_positions, kept_from_s)
        # Without a network a Pi's clock resumes at the last shutdown, so runs may overlap.
        events = sorted(
            (*logged.events, *(event for event in self._events if event["time_s"] in wanted)),
            key=lambda event: event["time_s"],
        )
        return found | {
            "events": events[-_MAX_EVENTS:],
            "positions": logged.positions,
            "logs_from_s": logged.from_s,
        }


class LogReader:
    """Searches the logs in `folder` on a thread, one query at a time; equal ones share a search."""

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
