# SPDX-License-Identifier: GPL-3.0-or-later
"""The craft's readiness: one state, which decides what every client is told. Sans-IO.

Heartbeat, SYS_STATUS, PreArm texts, refusals of transfers and commands, the status page and zenoh follow it.

A craft that arms may change protocol and speed, and finding it again takes a second or two: such a silence does not
change the state. While SYS_STATUS has an unhealthy PREARM_CHECK, Mission Planner keeps the last PreArm text on the HUD.
QGroundControl removes it after 35 s, and reads each out loud.
"""

from enum import Enum
from math import inf

from bridge.fc.profile import FlightController, Spoken
from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation
from bridge.missions.mission_service import NO_LINK, MissionService
from bridge.model.missions import Refusal
from bridge.model.vehicle import Health
from bridge.voice import sentences
from bridge.voice.happening import Happening
from protocols.mavlink.dialect import messages as m
from protocols.mission_item import MissionResult

#: Silence that counts as a loss. A switch of protocol takes less.
_LOST_S = 3.0
#: Silence that counts as a loss at the start: sensing the speed takes a few seconds.
_NOT_FOUND_S = 10.0
#: Mission Planner shows a text for 10 s.
_LOST_AGAIN_S = 9.0
#: Until a flight controller is found, it cannot be in the air. Reasons not to arm are repeated as often.
_RENEWED_S = 30.0
_CALIBRATING = Refusal(MissionResult.DENIED, sentences.CALIBRATING_NOW())


class ReadyState(Enum):
    """system_status: of the heartbeat on the ground. why: the reason not to arm, or empty if it may, or has its own."""

    def __init__(self, title: str, system_status: int, may_arm: bool, why: str) -> None:
        self.title, self.system_status, self.may_arm, self.why = title, system_status, may_arm, why
        self.is_lost = system_status == m.MAV_STATE_CRITICAL

    UNKNOWN = "unknown", m.MAV_STATE_UNINIT, False, "looking for the flight controller"
    NEVER_FOUND = "never found", m.MAV_STATE_CRITICAL, False, "no flight controller: {}"
    LOST = "lost", m.MAV_STATE_CRITICAL, False, "flight controller lost"
    CALIBRATING = "calibrating", m.MAV_STATE_CALIBRATING, False, "calibrating: wait until it is done"
    BLOCKED = "blocked", m.MAV_STATE_STANDBY, False, ""
    WRITING = "writing", m.MAV_STATE_STANDBY, True, ""
    READY = "ready", m.MAV_STATE_STANDBY, True, ""


class CraftReadiness:
    """Finds the state, and reports a loss, the end, a new flight controller, and the reasons not to arm.

    `was_found`: before the bridge was restarted in flight. `is_wired`: not behind a Wi-Fi adapter.
    """

    def __init__(
        self,
        session: FcSession,
        missions: MissionService,
        ground: Ground,
        now: float,
        *,
        was_found: bool,
        is_wired: bool,
    ) -> None:
        self._session = session
        self._missions = missions
        self._ground = ground
        self._check = "check power, wiring" if is_wired else "check power, Wi-Fi"
        self.state = ReadyState.UNKNOWN
        #: The reasons not to arm, while disarmed.
        self.reasons: tuple[str, ...] = ()
        #: True once a flight controller was found.
        self._was_found = was_found
        #: The name of the flight controller that was found last.
        self._known: str | None = None
        self._silent_since: float | None = now
        self._has_reported_loss = False
        #: A calibration ends by then. It may silence the flight controller, and end with a restart.
        self._calibrates_until = -inf
        self._told: list[Happening] = []
        self._told_at = -inf
        self.due = now + (_LOST_S if was_found else _NOT_FOUND_S)

    @property
    def has_board(self) -> bool:
        """False if the flight controller is lost, or was never found."""
        return self.state is not ReadyState.UNKNOWN and not self.state.is_lost

    @property
    def refusal(self) -> Refusal:
        """The reply to mission transfers while there is no flight controller."""
        if (trouble := self._session.state.trouble) is not None:
            return Refusal(MissionResult.DENIED, trouble)
        return _CALIBRATING if self.state is ReadyState.CALIBRATING else NO_LINK

    # Happenings.

    def lost(self, silent_since: float) -> None:
        if self._silent_since is None:
            self._silent_since = silent_since
        self.due = max(min(self.due, self._silent_since + _LOST_S), self._calibrates_until)

    def calibrates(self, until: float) -> None:
        """A calibration runs until then at the latest, or has ended (now)."""
        self._calibrates_until = until
        if self._silent_since is not None and not self._has_reported_loss:
            self.due = max(self._silent_since + _LOST_S, until)

    def found(self, controller: FlightController, now: float) -> None:
        silent_since, self._silent_since, self.due = self._silent_since, None, inf
        was_lost, self._has_reported_loss = self._has_reported_loss, False
        was_found, self._was_found = self._was_found, True
        profile, before = controller.profile, self._known
        is_switch = profile.spoken is Spoken.MAVLINK and before is not None
        if not is_switch:
            self._known = controller.name
        if profile.spoken is Spoken.OTHER_MAVLINK:
            # It represents itself.
            self.state, self.reasons = ReadyState.UNKNOWN, ()
            return
        if was_lost and silent_since is not None and was_found:
            # It replaces the warning on Mission Planner's HUD.
            self._ground.say(sentences.BACK(now - silent_since))
        elif controller.name != before and not is_switch:
            self._ground.say(sentences.FOUND(controller.name))

    def tick(self, now: float) -> None:
        """Report a loss, and again as long as it lasts."""
        if self._silent_since is None:
            return
        self._has_reported_loss = True
        self.due = now + _LOST_AGAIN_S
        if trouble := self._session.state.trouble:
            self._ground.say(trouble)
        elif not self._was_found:
            self.due = now + _RENEWED_S
            self._ground.say(sentences.NOT_FOUND(self._check))
        else:
            # Another text each time: Mission Planner does not renew a text that it still shows.
            self._ground.say(sentences.LOST(now - self._silent_since))

    # The state.

    def follow(self, now: float) -> None:
        """Update the state, before messages are made of it, and report the reasons not to arm if they have changed."""
        is_armed = self._session.vehicle.armed
        self.state, reasons = self._find(now)
        self.reasons = () if is_armed else reasons
        # A text would be too early during the first search.
        lines = sentences.prearm_lines(self.reasons) if self.reasons and self.state is not ReadyState.UNKNOWN else []
        if lines == self._told and now < self._told_at + _RENEWED_S:
            return
        if self._told and not lines and not is_armed:
            # Otherwise the previous reason would stay for 10 s in Mission Planner.
            self._ground.say(sentences.READY())
        self._told, self._told_at = lines, now
        for line in lines:
            self._ground.say(line)

    def tell(self, station: GroundStation) -> None:
        """Report the reasons to a newcomer, or in answer to MAV_CMD_RUN_PREARM_CHECKS."""
        for line in self._told:
            station.say(line)

    def _find(self, now: float) -> tuple[ReadyState, tuple[str, ...]]:
        """The state, and the reasons not to arm."""
        vehicle, line = self._session.vehicle, self._session.state
        if now < self._calibrates_until:
            state = ReadyState.CALIBRATING
        elif self._has_reported_loss:
            state = ReadyState.LOST if self._was_found else ReadyState.NEVER_FOUND
        elif not self._was_found:
            state = ReadyState.UNKNOWN
        elif line.controller is None or not (vehicle.armed or vehicle.fresh(Health, now)):
            # Silent for a moment, perhaps because it is arming and switches protocol.
            return self.state, self.reasons
        else:
            known = () if vehicle.armed else line.controller.profile.arming_blockers(vehicle, now)
            if known is None:
                return self.state, self.reasons
            may_arm = ReadyState.READY if self._missions.writing is None else ReadyState.WRITING
            return (ReadyState.BLOCKED if known else may_arm), known
        return state, (state.why.format(self._check) if line.trouble is None else line.trouble.text,)
