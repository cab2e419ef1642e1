# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that run only on the ground: calibrations.

The firmware checks neither whether it is flying nor whether a command is repeated (serial.c): a calibration stalls it
for seconds, a flash write for 0.1 s. So STATUS is read twice right before, and the command is sent once.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from bridge.fc.session import FcSession
from bridge.line.conversation import Conversation, LinkLost, ask_status, receive, send
from bridge.line.runner import Runner
from bridge.missions.mission_service import MissionService
from protocols.msp.commands import Msp, MspAction
from protocols.msp.frame import Direction, request
from protocols.msp.telemetry import STATUS_SIZE, Sensor
from protocols.rights.effect import Effect
from protocols.rights.msp import msp_right

_STATUS_CHECKS = 2
_ASKS_AFTER_ACTION = 12


@dataclass(frozen=True, slots=True)
class FcAction:
    """`needs` must be on board. `freezes`: a Harakiri does nothing else until it is done, and then restarts."""

    command: MspAction
    needs: Sensor
    freezes: bool


CALIBRATE_ACCELEROMETER = FcAction(MspAction.ACC_CALIBRATION, Sensor.ACCELEROMETER, freezes=True)
CALIBRATE_COMPASS = FcAction(MspAction.MAG_CALIBRATION, Sensor.COMPASS, freezes=True)


class ActionResult(Enum):
    """The result of an action, as text for the pilot (at most 50 characters)."""

    DONE = "Done"
    FREEZES = "Calibrating: it restarts when done (up to 5 min)"
    ARMED = "Armed: disarm first"
    NO_LINK = "No MSP link to the flight controller"
    OCCUPIED = "Wait for the mission transfer to end"
    NO_SENSOR = "The flight controller has no such sensor"
    NO_ANSWER = "No answer from the flight controller"
    REFUSED = "Not supported by the flight controller"


#: Without an answer it may be done.
NOT_DONE = frozenset(ActionResult) - {ActionResult.DONE, ActionResult.FREEZES, ActionResult.NO_ANSWER}


class FcActions:
    """Runs one action at a time, and none during a mission transfer."""

    def __init__(self, session: FcSession, missions: MissionService, runner: Runner) -> None:
        self._session = session
        self._missions = missions
        self._runner = runner
        self._present: FcAction | None = None

    @property
    def present(self) -> FcAction | None:
        """The action in progress."""
        return self._present

    def start(self, action: FcAction, on_done: Callable[[ActionResult], None], now: float) -> None:
        """Start an action; `on_done` gets the result, possibly before this returns."""
        controller = self._session.state.controller
        if controller is None or controller.arm_bit is None:
            # Without an arm flag it is unknown whether the craft is flying.
            on_done(ActionResult.NO_LINK)
            return
        if msp_right(controller.firmware, action.command, b"").effect is not Effect.CHANGE:
            on_done(ActionResult.REFUSED)
            return
        if self._session.vehicle.armed:
            on_done(ActionResult.ARMED)
            return
        if self._runner.needs_line or self._missions.acquire(self) is not None:
            on_done(ActionResult.OCCUPIED)
            return
        self._present = action
        arm_mask = 1 << controller.arm_bit

        def done(result: ActionResult | LinkLost, _at: float) -> None:
            self._present = None
            self._missions.release(self)
            if isinstance(result, LinkLost):
                result = ActionResult.NO_ANSWER
            elif result is ActionResult.DONE and action.freezes and controller.profile.restarts_after_calibration:
                result = ActionResult.FREEZES
            on_done(result)

        self._runner.start(_act(action, arm_mask), done, now)


def _act(action: FcAction, arm_mask: int) -> Conversation[ActionResult]:
    for _ in range(_STATUS_CHECKS):
        status = yield from ask_status()
        if status is None:
            return ActionResult.NO_ANSWER
        if status.box_flags & arm_mask:
            return ActionResult.ARMED
        if action.needs & ~status.sensors:
            return ActionResult.NO_SENSOR
    yield from send(request(action.command), action.command, 0, exclusive=True)
    reply = yield from receive(action.command)
    asks = 0
    while reply is None and asks < _ASKS_AFTER_ACTION:
        # A flash write may still stall it. It replies in order: STATUS first means that the action's reply is lost.
        asks += 1
        yield from send(request(Msp.STATUS), Msp.STATUS, STATUS_SIZE)
        reply = yield from receive(action.command, Msp.STATUS)
    if reply is None or reply.command != action.command:
        return ActionResult.NO_ANSWER
    return ActionResult.DONE if reply.direction is Direction.REPLY else ActionResult.REFUSED
