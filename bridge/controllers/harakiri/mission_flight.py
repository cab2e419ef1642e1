# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's report on a mission that it flies (docs/mission-flight.md): progress, and why a flight stopped."""

from collections.abc import Mapping

from bridge.fc.profile import Decoder, FlightController
from bridge.line.poll_schedule import Poll
from bridge.model.vehicle import MissionLeg, MissionStop, Source, Vehicle
from protocols.msp.commands import Msp
from protocols.msp.mission_flight import FLIGHT_REQUEST, FlightPhase, FlightProgress, FlightReason, decode_flight
from protocols.msp.nav import FINISHED, NavAction, NavMode, NavState, NavStatus

FLIGHT_SIZE = 24
#: Only for a build with mission flight.
FLIGHT_POLL = Poll(Msp.FLIGHT, FLIGHT_REQUEST, FLIGHT_SIZE, 0.5)
_STOPPED = {FlightPhase.OFF, FlightPhase.HELD, FlightPhase.NO_FIX, FlightPhase.HANDS}
_LANDING = {FlightPhase.DESCENT, FlightPhase.SINK}
_TEXTS: Mapping[FlightReason, str] = {
    FlightReason.DISABLED: "Mission not started: mission_fly is 0",
    FlightReason.NOT_ARMED: "Mission not started: switch was on at arming",
    FlightReason.FIX_MISSING: "Mission not started: no GPS fix",
    FlightReason.HOME_MISSING: "Mission not started: no home position",
    FlightReason.NOT_READY: "Mission not started: calibrate compass and baro",
    FlightReason.LIST_EMPTY: "Mission refused: the list is empty",
    FlightReason.LIST_DAMAGED: "Mission refused: the list is damaged",
    FlightReason.LIST_CHANGED: "Mission refused: list changed since arming",
    FlightReason.BAD_ORDER: "Mission refused: wrong command or order",
    FlightReason.BAD_PLACE: "Mission refused: a place is missing",
    FlightReason.FIRST_FAR: "Mission refused: the first place is too far",
    FlightReason.LEG_LONG: "Mission refused: a leg is too long",
    FlightReason.TOO_HIGH: "Mission refused: too high",
    FlightReason.ON_GROUND: "Mission refused: on the ground without TAKEOFF",
    FlightReason.THROTTLE_LOW: "Mission stopped: throttle not in the middle",
    FlightReason.NO_LIFT: "Mission stopped: the craft did not lift off",
    FlightReason.CLIMB_SLOW: "Mission stopped: the climb took too long",
    FlightReason.STALLED: "Mission stopped: too slow against the wind",
    FlightReason.TURN_SLOW: "Mission stopped: the craft did not turn",
    FlightReason.LAND_SLOW: "Landing takes too long",
    FlightReason.STICKS: "Mission stopped: roll or pitch stick",
    FlightReason.THROTTLE: "Mission stopped: throttle stick",
    FlightReason.FIX_LOST: "Mission stopped: GPS fix lost, fly by hand",
    FlightReason.RTL: "Mission ended: return to launch",
    FlightReason.FAILSAFE: "Mission ended: failsafe",
    FlightReason.FLOWN: "Mission flown",
}


def _flight(vehicle: Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    progress = decode_flight(payload)
    if progress is not None:
        vehicle.hear(MissionLeg(now, Source.MSP, leg_of(progress)))
        vehicle.hear(MissionStop(now, Source.MSP, _TEXTS.get(progress.reason, "")))


def leg_of(progress: FlightProgress) -> NavStatus:
    """The same report as an INAV or MultiWii gives it. A record counts as reached when the board says so."""
    number = progress.record or 0
    if not progress.in_command or progress.state in _STOPPED or not number:
        return NavStatus(0, 0, 0, 0, 0, 0)
    is_there = progress.reached is not None and progress.reached >= number
    state = NavState.LAND_IN_PROGRESS if progress.state in _LANDING else NavState.HOLD_TIMED if is_there else 0
    error = FINISHED if progress.state is FlightPhase.DONE else 0
    return NavStatus(NavMode.MISSION, state, NavAction.WAYPOINT, number, error, 0)


FLIGHT_DECODERS: Mapping[int, Decoder] = {Msp.FLIGHT: _flight}
