# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers `history?_time=[..]`: events of this run, earlier ones from telemetry logs, and missions from the store."""

from collections import deque
from collections.abc import Callable
from math import inf
from pathlib import Path

from payloads.mission_data import Json
from service.daemon.api import DaemonApi
from service.zenoh_link.log_reader import LogReader
from service.zenoh_link.logged_past import LoggedPast
from service.zenoh_link.time_range import parse_time_range

#: About 150 bytes each; a busy day has some hundred.
_MAX_EVENTS = 2000
_MAX_MISSIONS = 200
_DEFAULT_RANGE = "[now(-1h)..]"


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
