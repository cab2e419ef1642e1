# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts for the pilot about a flight controller that is not found, or lost, and its return. Sans-IO.

A craft that arms may change protocol and speed; finding it again takes a second or two. That is not reported as a
loss: Mission Planner reads warnings out loud.
"""

from math import inf

from bridge.fc.profile import FlightController, Spoken
from bridge.gcs.station import Severity

#: Silence that counts as a loss; a switch of protocol takes less.
_LOST_S = 3.0
#: The same at the start: sensing the speed takes a few seconds.
_NOT_FOUND_S = 10.0
#: Mission Planner shows a text for 10 s.
_REPEAT_S = 9.0
#: The same while no flight controller was ever found, which cannot be in the air then.
_NOT_FOUND_REPEAT_S = 30.0


class LinkAnnouncer:
    """`found` and `tick` return a text to show, or None. was_found: before the bridge was restarted in flight."""

    def __init__(self, now: float, *, was_found: bool = False) -> None:
        self._known: str | None = None
        self._was_found = was_found
        self._silent_since: float | None = now
        #: The time of the next `tick`.
        self.due = now + (_LOST_S if was_found else _NOT_FOUND_S)
        #: No loss is reported until then: the silence was asked for.
        self._quiet_until = -inf
        #: True from the first text about a loss until the flight controller is back.
        self.is_lost = False

    @property
    def why_unknown(self) -> str:
        """Why nothing is known about the flight controller, while it is lost or was never found; else empty."""
        if not self._was_found:
            return "no flight controller: check power, wiring" if self.is_lost else "looking for the flight controller"
        return "flight controller lost" if self.is_lost else ""

    def lost(self, silent_since: float) -> None:
        if self._silent_since is None:
            self._silent_since = silent_since
        self.due = max(min(self.due, self._silent_since + _LOST_S), self._quiet_until)

    def expect_silence(self, until: float) -> None:
        """The flight controller will be silent, and restart, because the pilot asked for that."""
        self._quiet_until = until
        if self._silent_since is not None and not self.is_lost:
            self.due = max(self._silent_since + _LOST_S, until)

    def found(self, controller: FlightController, now: float) -> tuple[Severity, str] | None:
        silent_since, self._silent_since, self.due = self._silent_since, None, inf
        was_lost, self.is_lost = self.is_lost, False
        was_found, self._was_found = self._was_found, True
        profile, before = controller.profile, self._known
        is_switch = profile.spoken is Spoken.MAVLINK and before is not None
        if not is_switch:
            self._known = controller.name
        if profile.notice is not None and controller.name != before:
            return Severity.WARNING, profile.notice
        if was_lost and silent_since is not None and was_found:
            # It replaces the warning on Mission Planner's HUD.
            return Severity.WARNING, f"Flight controller back after {now - silent_since:.0f} s"
        if controller.name == before or is_switch:
            return None
        return Severity.INFO, f"Found {controller.name}"

    def tick(self, now: float, trouble: str) -> tuple[Severity, str] | None:
        """Report a loss, and again as long as it lasts; `trouble`: its cause, if known, and what the pilot must do."""
        if self._silent_since is None:
            return None
        self.is_lost = True
        self.due = now + _REPEAT_S
        if trouble:
            return Severity.WARNING, trouble
        if not self._was_found:
            self.due = now + _NOT_FOUND_REPEAT_S
            return Severity.WARNING, "No flight controller found: check power, wiring"
        # Another text each time: Mission Planner does not renew a text that stands.
        return Severity.WARNING, f"Flight controller lost: silent for {now - self._silent_since:.0f} s"
