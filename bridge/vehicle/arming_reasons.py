# SPDX-License-Identifier: GPL-3.0-or-later
"""The reasons not to arm, as ground stations expect them: texts that begin with `PreArm:`, while disarmed. Sans-IO.

While SYS_STATUS has an unhealthy PREARM_CHECK, Mission Planner keeps the last such text on its HUD. QGroundControl
removes it after 35 s, and reads each out loud.
"""

from math import inf

from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation
from bridge.model.vehicle import Health
from bridge.vehicle.link_announcer import LinkAnnouncer
from bridge.voice.happening import Happening
from bridge.voice.sentences import READY, prearm_lines

_RENEWED_S = 30.0


class ArmingReasons:
    """Reports the reasons when they change, and every 30 s while they remain."""

    def __init__(self, session: FcSession, announcer: LinkAnnouncer, ground: Ground) -> None:
        self._session = session
        self._announcer = announcer
        self._ground = ground
        self.current: tuple[str, ...] = ()
        self._told: list[Happening] = []
        self._told_at = -inf

    def follow(self, now: float) -> None:
        """Update the reasons, before SYS_STATUS is made of them, and report them if they have changed."""
        self.current = self._find(now)
        # A text would be too early during the first search.
        is_searching = not (self._announcer.was_found or self._announcer.is_lost)
        lines = [] if is_searching else prearm_lines(self.current)
        if lines == self._told and now < self._told_at + _RENEWED_S:
            return
        if self._told and not lines:
            # Otherwise the previous reason would stay for 10 s in Mission Planner.
            self._ground.say(READY())
        self._told, self._told_at = lines, now
        for line in lines:
            self._ground.say(line)

    def tell(self, station: GroundStation) -> None:
        """Report the reasons to a newcomer, or in answer to MAV_CMD_RUN_PREARM_CHECKS."""
        for line in self._told:
            station.say(line)

    def _find(self, now: float) -> tuple[str, ...]:
        vehicle, state = self._session.vehicle, self._session.state
        if vehicle.armed:
            return ()
        if self._announcer.why_unknown:
            return (self._announcer.why_unknown if state.trouble is None else state.trouble.text,)
        if state.controller is None or vehicle.fresh(Health, now) is None:
            # Silent for a moment, perhaps because it is arming and switches protocol.
            return self.current
        known = state.controller.profile.arming_blockers(vehicle, now)
        return self.current if known is None else known
