# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pilot is told about the flight controller coming and going. Sans-IO.

A craft that arms may change protocol and speed, and is searched for a second or two. That is no news: Mission Planner
reads warnings out loud.
"""

from bridge.fc.autosense import Spoken
from bridge.fc.profile import FlightController
from bridge.gcs.station import Severity

#: Switching takes less.
_GRACE_S = 3.0


class LinkAnnouncer:
    """Decides what is news. Each method returns a text to show, or None."""

    def __init__(self) -> None:
        self._known: str | None = None
        self._lost_at: float | None = None

    def lost(self, now: float) -> None:
        """It does not answer any more."""
        if self._lost_at is None:
            self._lost_at = now

    def found(self, controller: FlightController) -> tuple[Severity, str] | None:
        """It is there."""
        self._lost_at = None
        profile = controller.profile
        if profile.spoken is Spoken.MAVLINK and not profile.is_passed_through and self._known is not None:
            return None
        before, self._known = self._known, controller.name
        if controller.name == before:
            return None
        if profile.notice is not None:
            return Severity.WARNING, profile.notice
        return Severity.INFO, f"Found {controller.name}"

    def tick(self, now: float) -> tuple[Severity, str] | None:
        """Notice that it stays away."""
        if self._lost_at is None or now < self._lost_at + _GRACE_S:
            return None
        self._lost_at = self._known = None
        return Severity.WARNING, "Flight controller lost"

    def next_deadline(self) -> float | None:
        """Return when `tick` has something to do."""
        return None if self._lost_at is None else self._lost_at + _GRACE_S
