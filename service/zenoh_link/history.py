# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers `history?_time=[..]`: events of this run, earlier ones from telemetry logs, and missions from the store."""

from collections import deque
from collections.abc import Callable
from functools import partial
from math import inf
from pathlib import Path

from service.daemon.api import DaemonApi
from service.daemon.mission_data import Json
from service.machine.threads import BackgroundThread
from service.zenoh_link.logged_past import LoggedPast, read_logged_past
from service.zenoh_link.time_range import parse_time_range

#: About 150 bytes each; a busy day has some hundred.
_MAX_EVENTS = 2000
_MAX_MISSIONS = 200
_DEFAULT_RANGE = "[now(-1h)..]"


class History:
    """Keeps the newest events. Missions and telemetry logs (in the folder `logs`) are read on request."""

    def __init__(self, api: DaemonApi, logs: Path | None, clock: Callable[[], float]) -> None:
        self._api = api
        self._logs = logs
        self._clock = clock
        self._disk = BackgroundThread("history")
        self._events: deque[Json] = deque(maxlen=_MAX_EVENTS)

    def add(self, event: Json) -> None:
        """Keep an event's payload, including its envelope."""
        self._events.append(event)

    async def answer(self, time_range: str | None, max_positions: int) -> Json:
        """The events, missions and positions of a time range; StoreError, OSError, or ValueError about the range."""
        wanted = parse_time_range(time_range or _DEFAULT_RANGE, self._clock())
        found = await self._api.missions_between(wanted.start_s, wanted.end_s, _MAX_MISSIONS)
        kept_from_s = self._events[0]["time_s"] if self._events else inf
        logged = LoggedPast()
        if self._logs is not None and (max_positions or wanted.start_s < kept_from_s):
            logged = await self._disk.ask(partial(read_logged_past, self._logs, wanted, max_positions))
        events = [event for event in logged.events if event["time_s"] < kept_from_s]
        events += [event for event in self._events if event["time_s"] in wanted]
        return found | {
            "events": events[-_MAX_EVENTS:],
            "positions": logged.positions,
            "logs_from_s": logged.from_s,
        }
