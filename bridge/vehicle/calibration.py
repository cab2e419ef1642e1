# SPDX-License-Identifier: GPL-3.0-or-later
"""A calibration from its start to its result, in the words that Mission Planner and QGroundControl wait for. Sans-IO.

No firmware reports the result over MSP. A calibrated accelerometer reads a level craft; a Harakiri stores a compass
calibration and then restarts. A Harakiri does nothing else meanwhile, so its silence is not reported as a loss.
"""

import math
from dataclasses import dataclass
from math import inf

from bridge.fc.actions import (
    CALIBRATE_ACCELEROMETER,
    CALIBRATE_COMPASS,
    NOT_DONE,
    ActionResult,
    FcAction,
    act,
    is_level,
)
from bridge.fc.session import FcSession
from bridge.gcs.flash_budget import TOO_MANY_WRITES
from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity, Station
from bridge.line.conversation import LinkLost
from bridge.missions.mission_service import MissionService
from bridge.vehicle.board_settings import BoardSettings
from bridge.vehicle.link_announcer import LinkAnnouncer
from protocols.mavlink.command import CommandResult
from protocols.mavlink.dialect import messages as m
from protocols.rights.effect import Effect
from protocols.rights.msp import msp_right

_TICK_S = 1.0
#: Mission Planner waits 25 s for the next COMMAND_ACK.
_ACK_INTERVAL_S = 5.0
#: Boards that stay reachable: MultiWii and its descendants collect compass values for 30 s, and accelerometer values
#: for up to 2 s.
_COMPASS_S, _ACCELEROMETER_S = 31.0, 4.0
#: Harakiri collects 500 compass samples in a time that its owner sets: one to five minutes (sensors.c).
_FROZEN_COMPASS_S = 60.0
#: A board that answers sooner has not calibrated its compass.
_SHORTEST_COMPASS_S = 45.0
#: Longer than any calibration, with the restart.
_LONGEST_S = 360.0
_COMPASS, _ONE_COMPASS = 0, 1 << 0
_UNKNOWN = math.nan
_OUTCOMES = {
    ActionResult.DONE: CommandResult.ACCEPTED,
    ActionResult.FREEZES: CommandResult.ACCEPTED,
    ActionResult.ARMED: CommandResult.DENIED,
    ActionResult.NO_LINK: CommandResult.DENIED,
    ActionResult.OCCUPIED: CommandResult.TEMPORARILY_REJECTED,
    ActionResult.NO_SENSOR: CommandResult.DENIED,
    ActionResult.SIX_POSITIONS: CommandResult.UNSUPPORTED,
    ActionResult.RUNNING: CommandResult.TEMPORARILY_REJECTED,
    ActionResult.NO_ANSWER: CommandResult.FAILED,
    ActionResult.REFUSED: CommandResult.UNSUPPORTED,
}


@dataclass(eq=False)
class Calibration:
    """The calibration in progress, at most one at a time."""

    _ground: Ground
    _session: FcSession
    _missions: MissionService
    _announcer: LinkAnnouncer
    _settings: BoardSettings
    #: The time of the next `tick`; infinity while none runs.
    due: float = inf
    _action: FcAction | None = None
    #: The one that the flight controller is being asked for.
    _asked_for: FcAction | None = None
    _restarts: bool = False
    _began_at: float = 0.0
    _acknowledge_at: float = 0.0

    def take(self, station: Station, command: int, action: FcAction, now: float) -> None:
        """Execute a command of a ground station, and acknowledge it."""
        if action in (self._asked_for, self._action):
            # Repeated by the user or duplicated by the network.
            self._acknowledge(station, command, CommandResult.IN_PROGRESS)
        elif self._action is not None:
            self._asked(station, command, action, ActionResult.RUNNING, now)
        elif not self._ground.allows_write(station, now):
            self._ground.say(Severity.ERROR, TOO_MANY_WRITES, station)
            self._acknowledge(station, command, CommandResult.TEMPORARILY_REJECTED)
        elif (refused := self._start(station, command, action, now)) is not None:
            self._asked(station, command, action, refused, now)

    def _start(self, station: Station, command: int, action: FcAction, now: float) -> ActionResult | None:
        """Ask the flight controller; the reason if that cannot be done now."""
        controller = self._session.state.controller
        if controller is None or controller.arm_bit is None:
            # Without an arm flag it is unknown whether the craft is flying.
            return ActionResult.NO_LINK
        if msp_right(controller.firmware, action.command, b"").effect is not Effect.CHANGE:
            return ActionResult.REFUSED
        if self._session.vehicle.armed:
            return ActionResult.ARMED
        if action is CALIBRATE_ACCELEROMETER and controller.profile.calibrates_six_positions:
            return ActionResult.SIX_POSITIONS
        if self._missions.runner.needs_line or self._missions.acquire(self) is not None:
            return ActionResult.OCCUPIED

        def done(result: ActionResult | LinkLost, _at: float) -> None:
            self._asked_for = None
            self._missions.release(self)
            if isinstance(result, LinkLost):
                result = ActionResult.NO_ANSWER
            elif result is ActionResult.DONE and controller.profile.restarts_after_calibration:
                result = ActionResult.FREEZES
            self._asked(station, command, action, result, now)

        self._asked_for = action
        self._missions.runner.start(act(action, controller.arm_bit), done, now)
        return None

    def _asked(self, station: Station, command: int, action: FcAction, outcome: ActionResult, now: float) -> None:
        """The flight controller has begun, or the reason why it has not is known."""
        result = _OUTCOMES[outcome]
        if outcome in NOT_DONE:
            self._ground.not_written(station)
        if result is not CommandResult.ACCEPTED:
            self._ground.say(Severity.ERROR, outcome.value, station)
            self._acknowledge(station, command, result)
            return
        self._ground.say(Severity.NOTICE, action.instruction, station)
        self._restarts = outcome is ActionResult.FREEZES
        if self._restarts:
            self._ground.say(Severity.NOTICE, outcome.value, station)
        if command == m.MAV_CMD_DO_START_MAG_CAL:
            self._acknowledge(station, command, result)
        self._station, self._command, self._action = station, command, action
        self._began_at = self._acknowledge_at = now
        if self._restarts:
            self._announcer.expect_silence(now + _LONGEST_S)
        self.tick(now)
        self._settings.changed_with_others(now)

    def tick(self, now: float) -> None:
        """Report a running calibration, and end it when its time has passed."""
        lasts_s = _LONGEST_S if self._restarts else self._usual_s
        if now >= self._began_at + lasts_s:
            self._conclude(now)
            return
        self.due = now + _TICK_S
        if self._command == m.MAV_CMD_DO_START_MAG_CAL:
            self._send_progress(now)
        elif now >= self._acknowledge_at:
            self._acknowledge_at = now + _ACK_INTERVAL_S
            self._acknowledge(self._station, self._command, CommandResult.IN_PROGRESS)

    def controller_found(self, now: float) -> None:
        """The flight controller answers again."""
        if self._action is not None and self._restarts:
            self._conclude(now)

    @property
    def is_endless(self) -> bool:
        """True if the calibration cannot be cancelled: only its own end, or a power cut, ends it."""
        return self._action is not None and self._restarts

    @property
    def _usual_s(self) -> float:
        if self._action is not CALIBRATE_COMPASS:
            return _ACCELEROMETER_S
        return _FROZEN_COMPASS_S if self._restarts else _COMPASS_S

    def _conclude(self, now: float) -> None:
        self.due = inf
        elapsed_s = now - self._began_at
        if self._restarts:
            self._announcer.expect_silence(now)
        if self._restarts and elapsed_s >= _LONGEST_S:
            self._end("it does not answer; power it off and on", now)
        elif self._action is CALIBRATE_COMPASS:
            is_stored = not self._restarts or elapsed_s >= _SHORTEST_COMPASS_S
            self._end("" if is_stored else "it was interrupted", now)
        else:
            self._missions.runner.start(is_level(), self._looked, now)

    def _looked(self, level: bool | LinkLost | None, now: float) -> None:
        if level is True:
            self._end("", now)
        else:
            self._end("not level, or moved" if level is False else "it does not answer", now)

    def _end(self, failure: str, now: float) -> None:
        """Report the result; `failure`: the reason, empty if it was successful."""
        sensor = "Compass" if self._action is CALIBRATE_COMPASS else "Accel"
        if failure:
            self._ground.say(Severity.ERROR, f"{sensor} calibration failed: {failure}", self._station)
        else:
            self._ground.say(Severity.NOTICE, f"{sensor} calibration successful", self._station)
        if self._command == m.MAV_CMD_DO_START_MAG_CAL:
            if not failure:
                self._send_progress(now, 100)
            self._send_report(m.MAG_CAL_FAILED if failure else m.MAG_CAL_SUCCESS)
        else:
            result = CommandResult.FAILED if failure else CommandResult.ACCEPTED
            self._acknowledge(self._station, self._command, result)
        self._action = None

    def _send_progress(self, now: float, percent: int | None = None) -> None:
        """MAG_CAL_PROGRESS: the part of the usual time."""
        if percent is None:
            percent = min(round(100 * (now - self._began_at) / self._usual_s), 99)
        running, nothing = m.MAG_CAL_RUNNING_STEP_ONE, [0] * 10
        self._ground.to(
            self._station,
            m.MAVLink_mag_cal_progress_message(_COMPASS, _ONE_COMPASS, running, 1, percent, nothing, 0.0, 0.0, 0.0),
        )

    def _send_report(self, status: int) -> None:
        """MAG_CAL_REPORT without offsets, which the board does not tell. Mission Planner ignores one with an x of 0.

        Not "autosaved", after which it demands a reboot: the board has restarted by itself, or needs none.
        """
        unknown = [_UNKNOWN] * 10
        self._ground.to(self._station, m.MAVLink_mag_cal_report_message(_COMPASS, _ONE_COMPASS, status, 0, *unknown))

    def _acknowledge(self, station: Station, command: int, result: CommandResult) -> None:
        self._ground.to(station, m.MAVLink_command_ack_message(command, result, 0, 0, station.sysid, station.compid))
