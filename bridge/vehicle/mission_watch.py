# SPDX-License-Identifier: GPL-3.0-or-later
"""Watches for mission changes by others than the bridge. Sans-IO."""

from math import inf

from bridge.gcs.station import Severity
from bridge.line.conversation import LinkLost
from bridge.missions.mission_service import MissionChange
from bridge.vehicle.mission_context import MissionContext


class MissionWatch:
    """Checks as often as the store needs it, while no transfer runs: at once after a check that took longer."""

    def __init__(self, context: MissionContext) -> None:
        self._context = context
        #: When the running check began; None while none runs.
        self._began_at: float | None = None
        #: The time of the next `tick`.
        self.due = inf

    def look(self, now: float) -> None:
        """Check now: a flight controller was found."""
        if self._began_at is None:
            self._began_at, self.due = now, inf
            self._context.runner.start(self._context.missions.is_outdated(), self._looked, now, in_background=True)

    def tick(self, now: float) -> None:
        if self._context.missions.fc_store is None or self._context.runner.is_busy:
            self.due = now + self._context.missions.watch_s
        else:
            self.look(now)

    def _looked(self, is_outdated: bool | LinkLost, now: float) -> None:
        if is_outdated is True:
            missions = self._context.missions
            # Telemetry makes room while a changed list is read, but not for the first reading: that is not urgent.
            self._context.runner.start(missions.catch_up(), self._caught_up, now, in_background=not missions.is_settled)
        else:
            self._caught_up(None, now)

    def _caught_up(self, news: MissionChange | LinkLost | None, now: float) -> None:
        assert self._began_at is not None
        self.due, self._began_at = max(now, self._began_at + self._context.missions.watch_s), None
        if not isinstance(news, MissionChange):
            return
        self._context.ground.say(Severity.WARNING if news.is_warning else Severity.NOTICE, news.text)
        self._context.log_event("warning" if news.is_warning else "info", "mission.changed_on_board", detail=news.text)
