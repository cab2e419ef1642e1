# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts for the pilot about a lost flight controller and its return. Sans-IO.

A craft that arms may change protocol and speed; finding it again takes a second or two. That is not reported as a
loss: Mission Planner reads warnings out loud.
"""

from math import inf

from bridge.fc.profile import FlightController, Spoken
from bridge.gcs.station import Severity

#: Silence that counts as a loss; a switch of protocol takes less.
_LOST_S = 3.0
_REPEAT_S = 10.0


class LinkAnnouncer:
    """`found` and `tick` return a text to show, or None."""

    def __init__(self) -> None:
        self._known: str | None = None
        self._silent_since: float | None = None
        #: The time of the next `tick`.
        self.due = inf
        #: True from the first text about a loss until the flight controller is back.
        self.is_lost = False

    def lost(self, silent_since: float) -> None:
        if self._silent_since is None:
            self._silent_since = silent_since
            self.due = silent_since + _LOST_S

    def found(self, controller: FlightController, now: float) -> tuple[Severity, str] | None:
        silent_since, self._silent_since, self.due = self._silent_since, None, inf
        was_lost, self.is_lost = self.is_lost, False
        profile, before = controller.profile, self._known
        is_switch = profile.spoken is Spoken.MAVLINK and before is not None
        if not is_switch:
            self._known = controller.name
        if profile.notice is not None and controller.name != before:
            return Severity.WARNING, profile.notice
        if was_lost and silent_since is not None:
            return Severity.NOTICE, f"Flight controller back after {now - silent_since:.0f} s"
        if controller.name == before or is_switch:
            return None
        return Severity.INFO, f"Found {controller.name}"

    def tick(self, now: float, trouble: str) -> tuple[Severity, str] | None:
        """Report a loss, and again every 10 s; `trouble`: its cause, if known, and what the pilot must do."""
        if self._silent_since is None:
            return None
        self.is_lost = True
        self.due = now + _REPEAT_S
        return Severity.WARNING, trouble or f"Flight controller lost: silent for {now - self._silent_since:.0f} s"
