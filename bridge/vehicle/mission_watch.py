# SPDX-License-Identifier: GPL-3.0-or-later
"""Watches for mission changes by others than the bridge. Sans-IO."""

from bridge.gcs.station import Post, Severity
from bridge.line.conversation import LinkLost
from bridge.line.runner import Runner
from bridge.missions.mission_service import MissionChange, MissionService
from bridge.model.events import EventLog

#: Short enough to notice a mission loaded with the sticks or written by another client within two seconds.
_INTERVAL_S = 1.0


class MissionWatch:
    """Checks once a second while no transfer runs."""

    def __init__(self, missions: MissionService, runner: Runner, post: Post, log_event: EventLog) -> None:
        self._missions = missions
        self._runner = runner
        self._post = post
        self._log_event = log_event
        self._is_looking = False
        self._due: float | None = None

    def look(self, now: float) -> None:
        """Check now: a flight controller was found."""
        self._due = now + _INTERVAL_S
        if not self._is_looking:
            self._is_looking = True
            self._runner.start(self._missions.watch(), self._looked, now)

    def tick(self, now: float) -> None:
        """Check if it is time."""
        if self._due is None or now < self._due:
            return
        if self._missions.dialect is None:
            self._due = None
        elif self._runner.is_busy:
            self._due = now + _INTERVAL_S
        else:
            self.look(now)

    def next_deadline(self) -> float | None:
        """The time of the next `tick`."""
        return self._due

    def _looked(self, news: MissionChange | LinkLost | None, _now: float) -> None:
        self._is_looking = False
        if not isinstance(news, MissionChange):
            return
        self._post.say(Severity.WARNING if news.is_warning else Severity.NOTICE, news.text)
        self._log_event("warning" if news.is_warning else "info", "mission.changed_on_board", detail=news.text)
