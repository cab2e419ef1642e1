# SPDX-License-Identifier: GPL-3.0-or-later
"""Watches for mission changes by others than the bridge. Sans-IO."""

from math import inf

from bridge.gcs.station import Post, Severity
from bridge.line.conversation import LinkLost
from bridge.line.runner import Runner
from bridge.missions.mission_service import MissionChange, MissionService
from bridge.model.events import EventLog


class MissionWatch:
    """Checks as often as the store needs it, while no transfer runs."""

    def __init__(self, missions: MissionService, runner: Runner, post: Post, log_event: EventLog) -> None:
        self._missions = missions
        self._runner = runner
        self._post = post
        self._log_event = log_event
        self._is_looking = False
        self._due: float | None = None
        self._began_at = 0.0

    def look(self, now: float) -> None:
        """Check now: a flight controller was found."""
        self._due = now + self._interval_s
        if not self._is_looking:
            self._is_looking, self._began_at = True, now
            self._runner.start(self._missions.watch(), self._looked, now, in_background=True)

    def tick(self, now: float) -> None:
        """Check if it is time."""
        if self._due is None or now < self._due:
            return
        if self._missions.dialect is None:
            self._due = None
        elif self._runner.is_busy:
            self._due = now + self._interval_s
        else:
            self.look(now)

    @property
    def _interval_s(self) -> float:
        return inf if self._missions.dialect is None else self._missions.dialect.watch_s

    def next_deadline(self) -> float | None:
        """The time of the next `tick`."""
        return self._due

    def _looked(self, news: MissionChange | LinkLost | None, now: float) -> None:
        self._is_looking = False
        if self._due is not None:
            # On a slow line, half of the time is left to others.
            self._due = max(self._due, 2 * now - self._began_at)
        if not isinstance(news, MissionChange):
            return
        self._post.say(Severity.WARNING if news.is_warning else Severity.NOTICE, news.text)
        self._log_event("warning" if news.is_warning else "info", "mission.changed_on_board", detail=news.text)
