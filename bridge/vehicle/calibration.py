# SPDX-License-Identifier: GPL-3.0-or-later
"""A calibration from its start to its result, in the words that Mission Planner and QGroundControl wait for. Sans-IO.

No firmware reports the result over MSP. A calibrated accelerometer reads a level craft; a Harakiri stores a compass
calibration and then restarts. A Harakiri does nothing else meanwhile, so its silence is not reported as a loss.
"""

import math
from math import inf

from bridge.fc.actions import CALIBRATE_COMPASS, FcAction, is_level
from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity, Station
from bridge.line.conversation import LinkLost
from bridge.line.runner import Runner
from bridge.vehicle.link_announcer import LinkAnnouncer
from protocols.mavlink.command import CommandResult
from protocols.mavlink.dialect import messages as m

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


class Calibration:
    """The calibration in progress, at most one at a time."""

    def __init__(self, ground: Ground, runner: Runner, announcer: LinkAnnouncer) -> None:
        self._ground = ground
        self._runner = runner
        self._announcer = announcer
        #: The time of the next `tick`; infinity while none runs.
        self.due = inf
        self.action: FcAction | None = None
        self._restarts = False
        self._began_at = self._acknowledge_at = 0.0

    def begin(self, station: Station, command: int, action: FcAction, now: float, *, restarts: bool) -> None:
        """The flight controller has begun; `restarts`: it is silent until it restarts."""
        self._station, self._command, self.action, self._restarts = station, command, action, restarts
        self._began_at = self._acknowledge_at = now
        if restarts:
            self._announcer.expect_silence(now + _LONGEST_S)
        self.tick(now)

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
            self._acknowledge(CommandResult.IN_PROGRESS)

    def controller_found(self, now: float) -> None:
        """The flight controller answers again."""
        if self.action is not None and self._restarts:
            self._conclude(now)

    @property
    def is_endless(self) -> bool:
        """True if the calibration cannot be cancelled: only its own end, or a power cut, ends it."""
        return self.action is not None and self._restarts

    @property
    def _usual_s(self) -> float:
        if self.action is not CALIBRATE_COMPASS:
            return _ACCELEROMETER_S
        return _FROZEN_COMPASS_S if self._restarts else _COMPASS_S

    def _conclude(self, now: float) -> None:
        self.due = inf
        elapsed_s = now - self._began_at
        if self._restarts:
            self._announcer.expect_silence(now)
        if self._restarts and elapsed_s >= _LONGEST_S:
            self._end("it does not answer; power it off and on", now)
        elif self.action is CALIBRATE_COMPASS:
            is_stored = not self._restarts or elapsed_s >= _SHORTEST_COMPASS_S
            self._end("" if is_stored else "it was interrupted", now)
        else:
            self._runner.start(is_level(), self._looked, now)

    def _looked(self, level: bool | LinkLost | None, now: float) -> None:
        if level is True:
            self._end("", now)
        else:
            self._end("not level, or moved" if level is False else "it does not answer", now)

    def _end(self, failure: str, now: float) -> None:
        """Report the result; `failure`: the reason, empty if it was successful."""
        sensor = "Compass" if self.action is CALIBRATE_COMPASS else "Accel"
        if failure:
            self._ground.say(Severity.ERROR, f"{sensor} calibration failed: {failure}", self._station)
        else:
            self._ground.say(Severity.NOTICE, f"{sensor} calibration successful", self._station)
        if self._command == m.MAV_CMD_DO_START_MAG_CAL:
            if not failure:
                self._send_progress(now, 100)
            self._send_report(m.MAG_CAL_FAILED if failure else m.MAG_CAL_SUCCESS)
        else:
            self._acknowledge(CommandResult.FAILED if failure else CommandResult.ACCEPTED)
        self.action = None

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

    def _acknowledge(self, result: CommandResult) -> None:
        station = self._station
        ack = m.MAVLink_command_ack_message(self._command, result, 0, 0, station.sysid, station.compid)
        self._ground.to(station, ack)
