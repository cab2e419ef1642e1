# SPDX-License-Identifier: GPL-3.0-or-later
"""A calibration from the start to the result, in the words that Mission Planner and QGroundControl wait for. Sans-IO.

The firmware does not check whether it is flying or a command is repeated (serial.c): a calibration stalls it
for seconds, a flash write for 0.1 s. So STATUS is read twice right before, and the command is sent once.

No firmware reports the result over MSP. A Harakiri stores it and then restarts. It is busy meanwhile, so the
silence is not reported as a loss.
"""

import math
from dataclasses import dataclass, field
from enum import Enum
from math import inf

from bridge.fc.session import FcSession
from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.line.conversation import Conversation, LinkLost, Receive, ask_status, send
from bridge.missions.mission_service import MissionService
from bridge.settings.board_settings import BoardSettings
from bridge.vehicle.readiness import CraftReadiness
from bridge.voice import sentences
from bridge.voice.happening import Happening
from protocols.mavlink.dialect import CommandResult
from protocols.mavlink.dialect import messages as m
from protocols.msp.commands import Msp, MspAction
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.telemetry import STATUS_SIZE, Sensor
from protocols.rights import Effect
from protocols.rights.msp import msp_right

_TICK_S = 1.0
#: Mission Planner waits 25 s for the next COMMAND_ACK.
_ACK_INTERVAL_S = 5.0
#: The result is acknowledged this often: two loops of Mission Planner read the link, and only one of them waits for it.
_RESULT_ACKS, _RESULT_AGAIN_S = 6, 0.3
#: Boards that stay reachable: MultiWii and its descendants collect compass values for 30 s, and accelerometer values
#: for up to 2 s.
_COMPASS_S, _ACCELEROMETER_S = 31.0, 4.0
#: Harakiri collects 500 compass samples in a time that the owner sets: one to five minutes (sensors.c).
_FROZEN_COMPASS_S = 60.0
#: A board that answers sooner has not calibrated the compass.
_SHORTEST_COMPASS_S = 45.0
#: Longer than any calibration, with the restart.
_LONGEST_S = 360.0
_COMPASS, _ONE_COMPASS = 0, 1 << 0
_UNKNOWN = (math.nan,) * 10
_STATUS_CHECKS = 2
_ASKS_AFTER_ACTION = 12


@dataclass(frozen=True, slots=True)
class FcAction:
    """A calibration. `needs`: the sensor. A Harakiri stops all else until it is done, and then restarts.

    name, instruction: for the pilot.
    """

    command: MspAction
    needs: Sensor
    name: str
    instruction: Happening


CALIBRATE_ACCELEROMETER = FcAction(
    MspAction.ACC_CALIBRATION, Sensor.ACCELEROMETER, "Accel", sentences.CALIBRATING_ACCELEROMETER()
)
CALIBRATE_COMPASS = FcAction(MspAction.MAG_CALIBRATION, Sensor.COMPASS, "Compass", sentences.CALIBRATING_COMPASS())


class ActionResult(Enum):
    """The result of an action: the reason if it failed, in at most 22 characters, and the acknowledgement."""

    def __init__(self, why: str, ack: CommandResult) -> None:
        self.why, self.ack = why, ack

    DONE = "", CommandResult.ACCEPTED
    FREEZES = "restarts", CommandResult.ACCEPTED
    ARMED = "armed", CommandResult.DENIED
    NO_BOARD = "no flight controller", CommandResult.DENIED
    OCCUPIED = "a transfer is running", CommandResult.TEMPORARILY_REJECTED
    NO_SENSOR = "no such sensor", CommandResult.DENIED
    SIX_POSITIONS = "use INAV Configurator", CommandResult.UNSUPPORTED
    RUNNING = "another is running", CommandResult.TEMPORARILY_REJECTED
    FLASH_WEAR = "again in 10 minutes", CommandResult.TEMPORARILY_REJECTED
    NO_ANSWER = "no answer", CommandResult.FAILED
    REFUSED = "not supported", CommandResult.UNSUPPORTED


@dataclass(eq=False)
class Calibration:
    """The calibration in progress, at most one at a time."""

    _ground: Ground
    _session: FcSession
    _missions: MissionService
    _readiness: CraftReadiness
    _settings: BoardSettings
    #: The time of the next `tick`, or infinity while none runs.
    due: float = inf
    _action: FcAction | None = None
    #: The one that the flight controller is being asked for.
    _asked_for: FcAction | None = None
    _restarts: bool = False
    _began_at: float = 0.0
    _acknowledge_at: float = 0.0
    _result_acks: list[CommandResult] = field(default_factory=list)

    def take(self, sender: Sender, command: int, action: FcAction, now: float) -> None:
        """Execute a command of a ground station, and acknowledge it."""
        self._result_acks.clear()
        if action in (self._asked_for, self._action):
            # Repeated by the user or duplicated by the network.
            sender.command_ack(command, CommandResult.IN_PROGRESS)
        elif self._action is not None:
            self._asked(sender, command, action, ActionResult.RUNNING, now)
        elif not sender.station.allows(Cost.FLASH):
            self._refuse(sender, command, action, ActionResult.FLASH_WEAR)
        elif (refused := self._start(sender, command, action, now)) is not None:
            self._asked(sender, command, action, refused, now)

    def _start(self, sender: Sender, command: int, action: FcAction, now: float) -> ActionResult | None:
        """Ask the flight controller. The reason if that cannot be done now."""
        controller = self._session.state.controller
        if controller is None:
            return ActionResult.NO_BOARD
        if self._session.vehicle.armed:
            return ActionResult.ARMED
        is_action = msp_right(controller.firmware, action.command, b"").effect is Effect.CHANGE
        if controller.arm_bit is None or not is_action:
            # Without an arm flag it is unknown whether the craft is flying.
            return ActionResult.REFUSED
        if action is CALIBRATE_ACCELEROMETER and controller.profile.calibrates_six_positions:
            return ActionResult.SIX_POSITIONS
        if self._missions.runner.needs_line or self._missions.acquire(self) is not None:
            return ActionResult.OCCUPIED

        def done(result: ActionResult | LinkLost, at: float) -> None:
            self._asked_for = None
            self._missions.release(self)
            if isinstance(result, LinkLost):
                result = ActionResult.NO_ANSWER
            elif result is ActionResult.DONE and controller.profile.restarts_after_calibration:
                result = ActionResult.FREEZES
            self._asked(sender, command, action, result, at)

        self._asked_for = action
        self._missions.runner.start(_act(action, controller.arm_bit), done, now)
        return None

    def _asked(self, sender: Sender, command: int, action: FcAction, outcome: ActionResult, now: float) -> None:
        """The flight controller has begun, or the reason why it has not is known."""
        result = outcome.ack
        if result is not CommandResult.ACCEPTED:
            self._refuse(sender, command, action, outcome)
            return
        sender.say(action.instruction)
        self._restarts = outcome is ActionResult.FREEZES
        if self._restarts:
            sender.say(sentences.RESTARTS_AFTERWARDS())
        if command == m.MAV_CMD_DO_START_MAG_CAL:
            sender.command_ack(command, result)
        self._sender, self._command, self._action = sender, command, action
        self._began_at = self._acknowledge_at = now
        self._readiness.calibrates(now + (_LONGEST_S if self._restarts else self._usual_s))
        self.tick(now)
        self._settings.may_have_changed(now)

    def _refuse(self, sender: Sender, command: int, action: FcAction, outcome: ActionResult) -> None:
        sender.say(sentences.NOT_CALIBRATED(action.name, outcome.why))
        sender.command_ack(command, outcome.ack)

    def tick(self, now: float) -> None:
        """Report a running calibration, and end it when its time has passed."""
        if self._action is None:
            self._acknowledge_result(now)
            return
        lasts_s = _LONGEST_S if self._restarts else self._usual_s
        if now >= self._began_at + lasts_s:
            self._conclude(now)
            return
        self.due = now + _TICK_S
        if self._command == m.MAV_CMD_DO_START_MAG_CAL:
            self._send_progress(now)
        elif now >= self._acknowledge_at:
            self._acknowledge_at = now + _ACK_INTERVAL_S
            self._sender.command_ack(self._command, CommandResult.IN_PROGRESS)

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
        self._readiness.calibrates(now)
        if self._restarts and elapsed_s >= _LONGEST_S:
            self._end("no answer, power cycle", now)
        else:
            is_short = self._action is CALIBRATE_COMPASS and self._restarts and elapsed_s < _SHORTEST_COMPASS_S
            self._end("interrupted" if is_short else "", now)

    def _end(self, failure: str, now: float) -> None:
        """Report the result. `failure`: the reason, empty if it was successful."""
        name = (self._action or CALIBRATE_ACCELEROMETER).name
        self._sender.say(sentences.NOT_CALIBRATED(name, failure) if failure else sentences.CALIBRATED(name))
        if self._command == m.MAV_CMD_DO_START_MAG_CAL:
            if not failure:
                self._send_progress(now, 100)
            self._send_report(m.MAG_CAL_FAILED if failure else m.MAG_CAL_SUCCESS)
        else:
            self._result_acks = [CommandResult.FAILED if failure else CommandResult.ACCEPTED] * _RESULT_ACKS
            self._acknowledge_result(now)
        self._action = None

    def _acknowledge_result(self, now: float) -> None:
        self.due = now + _RESULT_AGAIN_S if self._result_acks else inf
        if self._result_acks:
            self._sender.command_ack(self._command, self._result_acks.pop())

    def _send_progress(self, now: float, percent: int | None = None) -> None:
        """MAG_CAL_PROGRESS: the part of the usual time."""
        if percent is None:
            percent = min(round(100 * (now - self._began_at) / self._usual_s), 99)
        running, nothing = m.MAG_CAL_RUNNING_STEP_ONE, [0] * 10
        self._sender.to(
            m.MAVLink_mag_cal_progress_message(_COMPASS, _ONE_COMPASS, running, 1, percent, nothing, 0.0, 0.0, 0.0),
        )

    def _send_report(self, status: int) -> None:
        """MAG_CAL_REPORT without offsets, which the board does not report. Mission Planner ignores one with an x of 0.

        Not "autosaved", after which it demands a reboot: the board has restarted by itself, or needs none.
        """
        self._sender.to(m.MAVLink_mag_cal_report_message(_COMPASS, _ONE_COMPASS, status, 0, *_UNKNOWN))


def _act(action: FcAction, arm_bit: int) -> Conversation[ActionResult]:
    arm_mask = 1 << arm_bit
    for _ in range(_STATUS_CHECKS):
        status = yield from ask_status()
        if status is None:
            return ActionResult.NO_ANSWER
        if status.box_flags & arm_mask:
            return ActionResult.ARMED
        if action.needs & ~status.sensors:
            return ActionResult.NO_SENSOR
    awaited = frozenset((action.command,))
    asked = send(request(action.command), action.command, 0, exclusive=True)
    reply: MspFrame | None = yield Receive(awaited, asked)
    asks = 0
    while reply is None and asks < _ASKS_AFTER_ACTION:
        # A flash write may still stall it. It replies in order: STATUS first means that the action's reply is lost.
        asks += 1
        reply = yield Receive(awaited | {Msp.STATUS}, send(request(Msp.STATUS), Msp.STATUS, STATUS_SIZE))
    if reply is None or reply.command != action.command:
        return ActionResult.NO_ANSWER
    return ActionResult.DONE if reply.direction is Direction.REPLY else ActionResult.REFUSED
