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


@pytest.mark.parametrize("phase", FlightPhase)
def test_each_phase_is_flown_paused_or_off(phase: FlightPhase) -> None:
    report = flight_report(replace(FLYING, state=phase), None)
    assert report.is_flown is (phase is not FlightPhase.OFF and phase not in PAUSED)
    assert (report.progress is Progress.PAUSED) is (phase in PAUSED)
    assert (report.number == 0) is (phase is FlightPhase.OFF)
    assert report.reached == 1


@pytest.mark.parametrize("reason", FlightReason)
@pytest.mark.parametrize("phase", [FlightPhase.OFF, FlightPhase.HELD])
def test_each_reason_is_one_short_sentence_or_none(phase: FlightPhase, reason: FlightReason) -> None:
    why = flight_report(replace(FLYING, state=phase, reason=reason), None).why
    by_the_pilot = reason in (FlightReason.NONE, FlightReason.SWITCHED_OFF, FlightReason.DISARMED)
    assert (why is None) is by_the_pilot


def test_an_outdated_reason_is_not_reported() -> None:
    assert flight_report(FlightProgress(reason=FlightReason.RTL), None).why is None


def test_the_reported_leg_is_the_boards() -> None:
    report = flight_report(replace(FLYING, height_error=-1.5), None)
    assert report.way == Way(3.0, 9.0, -1.5)
    assert report.stage is None  # by its height


def test_the_bearing_is_cleared_without_a_target() -> None:
    assert flight_report(replace(FLYING, state=FlightPhase.SINK, distance=0.0), None).way == Way(0.0, 0.0, 0.0)


def test_a_landing_that_ends_with_disarming_completes_the_list() -> None:
    landing = flight_report(replace(FLYING, state=FlightPhase.DESCENT), None)
    disarmed = FlightProgress(record=2, reached=1, reason=FlightReason.DISARMED)
    landed = flight_report(disarmed, landing)
    assert (landed.number, landed.reached, landed.progress, landed.is_flown) == (2, 2, Progress.COMPLETE, False)
    assert flight_report(disarmed, landed) == landed
    assert flight_report(FlightProgress(), landed).progress is Progress.NOT_STARTED


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
