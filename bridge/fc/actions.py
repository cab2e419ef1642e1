# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that run only on the ground: calibrations.

The firmware checks neither whether it is flying nor whether a command is repeated (serial.c): a calibration stalls it
for seconds, a flash write for 0.1 s. So STATUS is read twice right before, and the command is sent once.
"""

from dataclasses import dataclass
from enum import Enum

from bridge.line.conversation import Conversation, Pause, Receive, ask, ask_status, send
from protocols.msp.commands import Msp, MspAction
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.telemetry import RAW_IMU_SIZE, STATUS_SIZE, Sensor, decode_raw_imu

_STATUS_CHECKS = 2
_ASKS_AFTER_ACTION = 12
#: After a restart the first readings may still settle.
_SETTLED_S, _LEVEL_CHECKS, _LEVEL_INTERVAL_S = 1.0, 5, 0.1
#: Of 1 g: 3 degrees. An uncalibrated sensor is off by as much.
_MAX_TILT = 0.05


@dataclass(frozen=True, slots=True)
class FcAction:
    """A calibration. `needs`: the sensor. A Harakiri does nothing else until it is done, and then restarts.

    instruction: for the pilot.
    """

    command: MspAction
    needs: Sensor
    instruction: str


CALIBRATE_ACCELEROMETER = FcAction(MspAction.ACC_CALIBRATION, Sensor.ACCELEROMETER, "Keep the craft level and still")
CALIBRATE_COMPASS = FcAction(MspAction.MAG_CALIBRATION, Sensor.COMPASS, "Turn the craft about all axes")


class ActionResult(Enum):
    """The result of an action, as text for the pilot (at most 50 characters)."""

    DONE = "Done"
    FREEZES = "Calibrating: it restarts when done (up to 5 min)"
    ARMED = "Armed: disarm first"
    NO_LINK = "No MSP link to the flight controller"
    OCCUPIED = "Wait for the mission transfer to end"
    NO_SENSOR = "The flight controller has no such sensor"
    SIX_POSITIONS = "Six positions: calibrate with INAV Configurator"
    RUNNING = "A calibration is running"
    NO_ANSWER = "No answer from the flight controller"
    REFUSED = "Not supported by the flight controller"


#: Without an answer it may be done.
NOT_DONE = frozenset(ActionResult) - {ActionResult.DONE, ActionResult.FREEZES, ActionResult.NO_ANSWER}


def is_level() -> Conversation[bool | None]:
    """True if the accelerometer reads a level craft, as it does right after its calibration; None: no answer."""
    yield Pause(_SETTLED_S)
    forward = left = up = 0
    for _ in range(_LEVEL_CHECKS):
        reply = yield from ask(request(Msp.RAW_IMU), Msp.RAW_IMU, RAW_IMU_SIZE)
        imu = None if reply is None else decode_raw_imu(reply.payload)
        if imu is None:
            return None
        forward, left, up = (total + value for total, value in zip((forward, left, up), imu.acc, strict=True))
        yield Pause(_LEVEL_INTERVAL_S)
    return max(abs(forward), abs(left)) <= _MAX_TILT * up


def act(action: FcAction, arm_bit: int) -> Conversation[ActionResult]:
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
