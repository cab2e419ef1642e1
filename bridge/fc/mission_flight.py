# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's reports on a mission that it flies (docs/mission-flight.md), from FLIGHT."""

from collections.abc import Mapping
from dataclasses import replace

from bridge.fc.profile import Decoder, FlightController
from bridge.line.poll_schedule import Poll
from bridge.model.missions import FlightReport, Stage, Way
from bridge.model.vehicle import MissionLeg, Source, Vehicle
from protocols.msp.commands import Msp
from protocols.msp.mission_flight import (
    FLIGHT_REQUEST,
    FLIGHT_SIZE,
    FlightPhase,
    FlightProgress,
    FlightReason,
    decode_flight,
)
from reports.vehicle_groups import Progress

#: A build without mission flight refuses it, and is not asked again.
FLIGHT_POLL = Poll(Msp.FLIGHT, FLIGHT_REQUEST, FLIGHT_SIZE, 0.5)
#: The craft does something else than its list: flies home, or lands where it is.
_EMERGENCIES = frozenset(
    (FlightReason.RTL, FlightReason.FAILSAFE, FlightReason.HOLD_LOST, FlightReason.BLIND, FlightReason.BATTERY)
)
_PAUSED = frozenset((FlightPhase.HELD, FlightPhase.NO_FIX))
#: In the other phases the height decides.
_STAGES: Mapping[FlightPhase, Stage] = {
    FlightPhase.WAIT: Stage.ON_GROUND,
    FlightPhase.LIFT: Stage.TAKEOFF,
    FlightPhase.RISE: Stage.TAKEOFF,
    FlightPhase.DESCENT: Stage.LANDING,
    FlightPhase.SINK: Stage.LANDING,
}
_FLOWN = "Mission flown"
_COMPASS_OFF_DEG = 20
_LOW_BATTERY = "Battery low: land, or switch GPS HOME on"
#: Nothing is said about the pilot's own switch and disarming.
_WHY: Mapping[FlightReason, str] = {
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
    FlightReason.TOO_HIGH: "Mission refused: an altitude is too high",
    FlightReason.ON_GROUND: "Mission refused: below 1 m it needs TAKEOFF first",
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
    FlightReason.FLOWN: _FLOWN,
    FlightReason.AWAY: "Mission stopped: off course, compass or GPS wrong",
    FlightReason.COMPASS: "Mission stopped: the compass is wrong",
    FlightReason.HOLD_LOST: "Landing: it cannot hold its place",
    FlightReason.BLIND: "Landing: no GPS fix for too long",
    FlightReason.FENCE: "Mission stopped: outside mission_radius or _height",
    FlightReason.BATTERY: "Mission ended: battery low",
    FlightReason.JUMP: "Mission stopped: the GPS has jumped",
}


def _flight(vehicle: Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    progress = decode_flight(payload)
    if progress is not None:
        report = replace(flight_report(progress, vehicle.last_flight), summary=progress.summary)
        vehicle.hear(MissionLeg(now, Source.MSP, report))


FLIGHT_DECODERS: Mapping[int, Decoder] = {Msp.FLIGHT: _flight}


def flight_report(progress: FlightProgress, before: FlightReport | None) -> FlightReport:
    """`before`: the last report. Only it shows that a list that ended with LAND was flown: the board has disarmed."""
    record, reached = progress.record or 0, progress.reached or 0
    if progress.state is FlightPhase.OFF:
        if before is not None and progress.reason is FlightReason.DISARMED and _has_landed(before):
            return FlightReport(record, record, Progress.COMPLETE, is_flown=False, why=_FLOWN)
        why = _WHY.get(progress.reason, "") if progress.switch_on else ""
        return FlightReport(0, reached, Progress.NOT_STARTED, is_flown=False, why=why)
    why = _WHY.get(progress.reason) or (_LOW_BATTERY if progress.battery_low else _compass(progress))
    if progress.state in _PAUSED:
        return FlightReport(record, reached, Progress.PAUSED, is_flown=False, why=why)
    way = Way(progress.distance, progress.bearing if progress.distance else 0.0, progress.height_error)
    state = Progress.COMPLETE if progress.state is FlightPhase.DONE else Progress.ACTIVE
    if progress.reason in _EMERGENCIES:
        state = Progress.PAUSED
    return FlightReport(record, reached, state, is_flown=True, way=way, stage=_STAGES.get(progress.state), why=why)


def _compass(progress: FlightProgress) -> str:
    """Rounded, so that it is said once."""
    error = round((progress.compass or 0) / 10) * 10
    return f"Compass about {abs(error)} deg off: check mag_dec" if abs(error) >= _COMPASS_OFF_DEG else ""


def _has_landed(before: FlightReport) -> bool:
    """At the end of its list."""
    return (before.stage is Stage.LANDING and before.progress is Progress.ACTIVE) or (
        before.progress is Progress.COMPLETE and not before.is_flown
    )
