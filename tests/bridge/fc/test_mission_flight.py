# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's reports on a mission flight: progress, stage, and the reason for a stop."""

from dataclasses import replace

import pytest

from bridge.controllers.harakiri.profile import PATCHED
from bridge.fc.mission_flight import flight_report
from bridge.fc.msp_telemetry import hear_msp
from bridge.fc.profile import FlightController
from bridge.model.missions import Stage, Way
from bridge.model.vehicle import MissionLeg, Vehicle
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.mission_flight import FLIGHT, FlightPhase, FlightProgress, FlightReason
from reports.vehicle_groups import Progress
from simulator.naze.replies import encode_flight

PAUSED = (FlightPhase.HELD, FlightPhase.NO_FIX)
FLYING = FlightProgress(
    FlightPhase.LEG, switch_on=True, in_command=True, record=2, reached=1, distance=3.0, bearing=9.0
)


def test_each_phase_is_flown_paused_or_off() -> None:
    for phase in FlightPhase:
        report = flight_report(replace(FLYING, state=phase), None)
        assert report.is_flown is (phase is not FlightPhase.OFF and phase not in PAUSED), phase
        assert (report.progress is Progress.PAUSED) is (phase in PAUSED), phase
        assert (report.number == 0) is (phase is FlightPhase.OFF), phase
        assert report.reached == 1


@pytest.mark.parametrize("phase", [FlightPhase.OFF, FlightPhase.HELD])
def test_only_a_reason_by_the_pilot_is_not_said(phase: FlightPhase) -> None:
    reports = {reason: flight_report(replace(FLYING, state=phase, reason=reason), None) for reason in FlightReason}
    silent = {reason for reason, report in reports.items() if report.why is None}
    assert silent == {FlightReason.NONE, FlightReason.SWITCHED_OFF, FlightReason.DISARMED}


def test_the_reported_leg_is_the_boards() -> None:
    report = flight_report(replace(FLYING, height_error=-1.5), None)
    assert report.way == Way(3.0, 9.0, -1.5)
    assert report.stage is None  # by its height


def test_the_bearing_is_cleared_without_a_target() -> None:
    assert flight_report(replace(FLYING, state=FlightPhase.SINK, distance=0.0), None).way == Way(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "reason", [FlightReason.RTL, FlightReason.FAILSAFE, FlightReason.HOLD_LOST, FlightReason.BLIND]
)
def test_an_emergency_landing_does_not_complete_the_list(reason: FlightReason) -> None:
    landing = flight_report(replace(FLYING, state=FlightPhase.SINK, reason=reason), None)
    assert (landing.progress, landing.stage) == (Progress.PAUSED, Stage.LANDING)
    disarmed = FlightProgress(record=2, reached=1, reason=FlightReason.DISARMED)
    assert flight_report(disarmed, landing).progress is Progress.NOT_STARTED


@pytest.mark.parametrize(
    ("compass", "why"), [(None, ""), (-12.0, ""), (28.0, "30 deg"), (31.0, "30 deg"), (-44.0, "40 deg")]
)
def test_a_compass_error_is_reported_once(compass: float | None, why: str) -> None:
    said = flight_report(replace(FLYING, compass=compass), None).why
    assert why in (said.text if said else "")
    assert (said is None) is (why == "")


@pytest.mark.parametrize("payload", [b"", b"\x0b" + bytes(25), b"\0\x09" + bytes(24), encode_flight(FLYING)[:-1]])
def test_other_replies_are_ignored(payload: bytes) -> None:
    vehicle = Vehicle()
    hear_msp(vehicle, MspFrame(Direction.REPLY, FLIGHT, payload), FlightController(PATCHED, PATCHED.name), 0.0)
    assert vehicle.last(MissionLeg) is None
