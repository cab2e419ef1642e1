# SPDX-License-Identifier: GPL-3.0-or-later
"""Watches for mission changes by others than the bridge. Sans-IO."""

from math import inf

from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity
from bridge.line.conversation import LinkLost
from bridge.missions.mission_service import MissionChange, MissionService
from bridge.model.events import EventLog


class MissionWatch:
    """Checks as often as the store needs it, while no transfer runs: at once after a check that took longer."""

    def __init__(self, missions: MissionService, ground: Ground, log_event: EventLog) -> None:
        self._missions = missions
        self._ground = ground
        self._log_event = log_event
        #: When the running check began; None while none runs.
        self._began_at: float | None = None
        #: The time of the next `tick`. A flight controller that was just found is checked at once.
        self.due = inf

    def tick(self, now: float) -> None:
        self.due = now + self._missions.watch_s
        if self._began_at is None and not self._missions.runner.is_busy and self.due < inf:
            self._began_at, self.due = now, inf
            self._missions.runner.start(self._missions.is_outdated(), self._looked, now, in_background=True)

    def _looked(self, is_outdated: bool | LinkLost, now: float) -> None:
        if is_outdated is True:
            # Telemetry makes room while a changed list is read, but not for the first reading: that is not urgent.
            is_first = not self._missions.is_settled
            self._missions.runner.start(self._missions.catch_up(), self._caught_up, now, in_background=is_first)
        else:
            self._caught_up(None, now)

    def _caught_up(self, news: MissionChange | LinkLost | None, now: float) -> None:
        assert self._began_at is not None
        self.due, self._began_at = max(now, self._began_at + self._missions.watch_s), None
        if not isinstance(news, MissionChange):
            return
        self._ground.say(Severity.WARNING if news.is_warning else Severity.NOTICE, news.text)
        self._log_event("warning" if news.is_warning else "info", "mission.changed_on_board", detail=news.text)
