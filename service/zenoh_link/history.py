# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers `history?_time=[..]`: events since the start of the daemon, and missions from the store."""

import time
from collections import deque

from service.control.mission_data import Json
from service.daemon.api import MissionJobs
from service.zenoh_link.time_range import parse_time_range

#: About 150 bytes each; a busy day has some hundred.
_MAX_EVENTS = 2000
_MAX_MISSIONS = 200
_DEFAULT_RANGE = "[now(-1h)..]"


class History:
    """Keeps the newest events; missions are read from the store when they are asked for."""

    def __init__(self, jobs: MissionJobs) -> None:
        self._jobs = jobs
        self._events: deque[Json] = deque(maxlen=_MAX_EVENTS)

    def add(self, event: Json) -> None:
        """Keep an event's payload, including its envelope."""
        self._events.append(event)

    async def answer(self, time_range: str | None) -> Json:
        """The events and missions of a time range; StoreError, or ValueError about the range."""
        wanted = parse_time_range(time_range or _DEFAULT_RANGE, time.time())
        missions = (await self._jobs.list_missions(_MAX_MISSIONS))["missions"]
        return {
            "events": [event for event in self._events if event["time_s"] in wanted],
            "missions": [mission for mission in missions if mission["received_at"] in wanted],
        }
