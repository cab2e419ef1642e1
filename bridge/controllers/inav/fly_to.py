# SPDX-License-Identifier: GPL-3.0-or-later
"""Set waypoint: makes an INAV that flies the mission fly to another of the records (MSP2_INAV_SET_WP_INDEX).

INAV checks that it is armed, in waypoint mode, and that the list has the record. It also accepts a new record while it
lands and lands nevertheless, and would take off again after a landing: both are refused here. The reply proves nothing,
so NAV_STATUS is read afterwards.
"""

from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, Pause, ask
from bridge.model.craft import ARM_BOX, MISSION_BOXES, names_of_active
from bridge.model.missions import Refusal
from bridge.voice import sentences
from protocols.mission_item import MissionResult
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, request
from protocols.msp.inav import STATUS_SIZE, decode_inav_status
from protocols.msp.nav import (
    FINISHED,
    LANDING,
    LEGS,
    NAV_STATUS_SIZE,
    SET_WP_INDEX,
    NavAction,
    NavMode,
    NavRecord,
    NavStatus,
    decode_nav_status,
    encode_fly_to,
)

#: Actions that it flies to; INAV executes the others and continues to the next of these.
FLOWN_TO = LEGS | {NavAction.RTH}
#: The first version with the request.
_FIRST = 9, 1, 0
_LOOKS, _LOOK_INTERVAL_S = 5, 0.1


_NOT_FLOWN = Refusal(MissionResult.DENIED, sentences.SET_IN_FLIGHT())
_LANDS = Refusal(MissionResult.DENIED, sentences.SET_WHILE_LANDING())
_CHANGED = Refusal(MissionResult.DENIED, sentences.SET_ON_CHANGED_LIST())
_UNCHANGED = Refusal(MissionResult.ERROR, sentences.SET_WITHOUT_EFFECT())
_NO_ANSWER = Refusal(MissionResult.ERROR, sentences.SET_UNANSWERED())


def fly_to(
    number: int, record: NavRecord, held: Conversation[NavRecord | None], board: FlightController
) -> Conversation[Refusal | None]:
    """Make INAV fly to record `number`. Returns None if it does. held: reads the record that INAV has there."""
    reply = yield from ask(request(Msp.INAV_STATUS), Msp.INAV_STATUS, STATUS_SIZE)
    state = None if reply is None else decode_inav_status(reply.payload)
    active = names_of_active(state.box_flags, board.boxes) if state else set()
    status = yield from _ask_status()
    if state is None or status is None:
        return _NO_ANSWER
    if ARM_BOX not in active or not active & MISSION_BOXES or status.mode != NavMode.MISSION:
        return _NOT_FLOWN
    if _is_down(status):
        return _LANDS
    if (yield from held) != record:
        return _CHANGED
    reply = yield from ask(encode_fly_to(number), SET_WP_INDEX, 0, tries=1)
    if reply is not None and reply.direction is Direction.ERROR:
        return _refused(board)
    for _ in range(_LOOKS):
        status = yield from _ask_status()
        if status is not None and status.number == number:
            return None
        yield Pause(_LOOK_INTERVAL_S)
    return _NO_ANSWER if reply is None or status is None else _UNCHANGED


def _ask_status() -> Conversation[NavStatus | None]:
    reply = yield from ask(request(Msp.NAV_STATUS), Msp.NAV_STATUS, NAV_STATUS_SIZE)
    return None if reply is None else decode_nav_status(reply.payload)


def _is_down(status: NavStatus) -> bool:
    return status.state in LANDING or (status.error == FINISHED and status.action == NavAction.LAND)


def _refused(board: FlightController) -> Refusal:
    if board.version is not None and board.version < _FIRST:
        older = sentences.SET_ON_NEWER_INAV(".".join(map(str, board.version)))
        return Refusal(MissionResult.DENIED, older)
    return Refusal(MissionResult.DENIED, sentences.SET_REFUSED_BY_INAV())
