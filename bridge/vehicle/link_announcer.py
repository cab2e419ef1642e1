# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts for the pilot about a flight controller that is not found, or lost, and its return. Sans-IO.

A craft that arms may change protocol and speed; finding it again takes a second or two. That is not reported as a
loss: Mission Planner reads warnings out loud.
"""

from collections.abc import Callable
from math import inf

from bridge.fc.profile import FlightController, Spoken
from bridge.voice import sentences
from bridge.voice.happening import Happening

#: Silence that counts as a loss; a switch of protocol takes less.
_LOST_S = 3.0
#: Silence that counts as a loss at the start: sensing the speed takes a few seconds.
_NOT_FOUND_S = 10.0
#: Mission Planner shows a text for 10 s.
_REPEAT_S = 9.0
#: While no flight controller was ever found: it cannot be in the air then.
_NOT_FOUND_REPEAT_S = 30.0


class LinkAnnouncer:
    """Reports a loss, its end and a new flight controller with `say`.

    `trouble` gives the cause of a loss, if known, and what the pilot must do. `was_found`: before the bridge was
    restarted in flight. `is_wired`: not behind a Wi-Fi adapter.
    """

    def __init__(
        self,
        say: Callable[[Happening], None],
        trouble: Callable[[], Happening | None],
        now: float,
        *,
        was_found: bool = False,
        is_wired: bool = True,
    ) -> None:
        self._say = say
        self._trouble = trouble
        self._check = "check power, wiring" if is_wired else "check power, Wi-Fi"
        self._known: str | None = None
        #: True once a flight controller was found.
        self.was_found = was_found
        self._silent_since: float | None = now
        self.due = now + (_LOST_S if was_found else _NOT_FOUND_S)
        #: No loss is reported until then: the silence is expected.
        self._quiet_until = -inf
        #: True from the first text about a loss until the flight controller is back.
        self.is_lost = False

    @property
    def why_unknown(self) -> str:
        """The reason for missing values while the flight controller is lost or was never found; else empty."""
        if not self.was_found:
            return f"no flight controller: {self._check}" if self.is_lost else "looking for the flight controller"
        return "flight controller lost" if self.is_lost else ""

    def lost(self, silent_since: float) -> None:
        if self._silent_since is None:
            self._silent_since = silent_since
        self.due = max(min(self.due, self._silent_since + _LOST_S), self._quiet_until)

    def expect_silence(self, until: float) -> None:
        """Expect silence and a restart of the flight controller, which the pilot has caused."""
        self._quiet_until = until
        if self._silent_since is not None and not self.is_lost:
            self.due = max(self._silent_since + _LOST_S, until)

    def found(self, controller: FlightController, now: float) -> None:
        silent_since, self._silent_since, self.due = self._silent_since, None, inf
        was_lost, self.is_lost = self.is_lost, False
        was_found, self.was_found = self.was_found, True
        profile, before = controller.profile, self._known
        is_switch = profile.spoken is Spoken.MAVLINK and before is not None
        if not is_switch:
            self._known = controller.name
        if profile.notice is not None and controller.name != before:
            self._say(profile.notice())
        elif was_lost and silent_since is not None and was_found:
            # It replaces the warning on Mission Planner's HUD.
            self._say(sentences.BACK(now - silent_since))
        elif controller.name != before and not is_switch:
            self._say(sentences.FOUND(controller.name))

    def tick(self, now: float) -> None:
        """Report a loss, and again as long as it lasts."""
        if self._silent_since is None:
            return
        self.is_lost = True
        self.due = now + _REPEAT_S
        if trouble := self._trouble():
            self._say(trouble)
        elif not self.was_found:
            self.due = now + _NOT_FOUND_REPEAT_S
            self._say(sentences.NOT_FOUND(self._check))
        else:
            # Another text each time: Mission Planner does not renew a text that it still shows.
            self._say(sentences.LOST(now - self._silent_since))
