# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's reports on a mission that it flies (docs/mission-flight.md), from FLIGHT."""

from collections.abc import Mapping
from dataclasses import replace

from bridge.fc.profile import Decoder, FlightController
from bridge.line.poll_schedule import Poll
from bridge.model.missions import FlightReport, Stage, Way
from bridge.model.vehicle import MissionLeg, Source, Vehicle
from bridge.voice import sentences
from bridge.voice.happening import Happening
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
#: The craft does something else than the list: flies home, or lands where it is.
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
_COMPASS_OFF_DEG = 20


def _flight(vehicle: Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    if (progress := decode_flight(payload)) is not None:
        report = replace(flight_report(progress, vehicle.last_report), summary=progress.summary)
        vehicle.hear(MissionLeg(now, Source.MSP, report))


FLIGHT_DECODERS: Mapping[int, Decoder] = {Msp.FLIGHT: _flight}


def flight_report(progress: FlightProgress, before: FlightReport | None) -> FlightReport:
    """`before`: the last report. Only it shows that a list that ended with LAND was flown: the board has disarmed."""
    record, reached = progress.record or 0, progress.reached or 0
    if progress.state is FlightPhase.OFF:
        if before is not None and progress.reason is FlightReason.DISARMED and _has_landed(before):
            return FlightReport(
                record, record, Progress.COMPLETE, is_flown=False, why=sentences.of_flight(FlightReason.FLOWN)
            )
        why = sentences.of_flight(progress.reason) if progress.switch_on else None
        return FlightReport(0, reached, Progress.NOT_STARTED, is_flown=False, why=why)
    why = sentences.of_flight(progress.reason) or _warning(progress)
    if progress.state in _PAUSED:
        return FlightReport(record, reached, Progress.PAUSED, is_flown=False, why=why)
    way = Way(progress.distance, progress.bearing if progress.distance else 0.0, progress.height_error)
    state = Progress.COMPLETE if progress.state is FlightPhase.DONE else Progress.ACTIVE
    if progress.reason in _EMERGENCIES:
        state = Progress.PAUSED
    return FlightReport(record, reached, state, is_flown=True, way=way, stage=_STAGES.get(progress.state), why=why)


def _warning(progress: FlightProgress) -> Happening | None:
    if progress.battery_low:
        return sentences.LOW_BATTERY()
    # Rounded, so that it is said once.
    error = round((progress.compass or 0) / 10) * 10
    return sentences.COMPASS_OFF(abs(error)) if abs(error) >= _COMPASS_OFF_DEG else None


def _has_landed(before: FlightReport) -> bool:
    """At the end of the list."""
    return (before.stage is Stage.LANDING and before.progress is Progress.ACTIVE) or (
        before.progress is Progress.COMPLETE and not before.is_flown
    )
