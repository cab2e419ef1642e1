# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions flown by the real image with mission flight in a sky that lies, whole and interrupted.

make real-board IMAGE=X.elf FLY=1. The image must be of TestCode3. It boots once; between two flights
another craft is set out at the launch place.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import pytest

from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.mission_flight import FlightPhase, FlightProgress, FlightReason
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.prepared_flash import prepared_flash
from simulator.flights.judgement import extremes, is_flown, judge
from simulator.flights.mission_run import MissionRun, fly_mission
from simulator.flights.mission_upload import UnfitImageError, require_mission_flight, upload
from simulator.flights.pilot import LOW, MIDDLE, Pilot
from simulator.flights.track import Track
from simulator.sky.body import Airframe
from simulator.sky.earth import Place
from simulator.sky.lies import Lies
from simulator.sky.sky import Weather
from tests.support.real_bench import Figure

pytestmark = pytest.mark.skipif(not os.environ.get("NAZE_FLY"), reason="NOT RUN: takes an hour: make real-board FLY=1")
PLACE = Place()
#: The attitude and the heights recover from being moved.
SETTLE_S = 6.0


def record(command: WpCommand, place: tuple[float, float] | None, height: int = 0, **fields: int) -> WpRecord:
    lat, lon = PLACE.coordinates((*place, 0.0)) if place else (0.0, 0.0)
    return WpRecord(round(lat * 1e7), round(lon * 1e7), height, 0, 0, 2, 0, command)._replace(**fields)


HOME, TAKEOFF = record(WpCommand.WAYPOINT, (0.0, 0.0)), record(WpCommand.TAKEOFF, None, 4)
CORNER, PAUSE = record(WpCommand.WAYPOINT, (20.0, 0.0), 6), record(WpCommand.LOITER_TIME, (8.0, -15.0), 6, time=3)
TURN = record(WpCommand.LOITER_TURNS, (20.0, 0.0), 6, turns=1)
LISTS = (
    [HOME, TAKEOFF, CORNER, record(WpCommand.WAYPOINT, (20.0, -15.0), 6, time=1), PAUSE],
    [HOME, TAKEOFF, TURN, record(WpCommand.LOITER_UNLIM, (8.0, -12.0), 5)],
    [HOME, TAKEOFF, CORNER, record(WpCommand.RETURN_TO_LAUNCH, None, 5), record(WpCommand.LAND, None)],
)


@pytest.fixture(scope="module")
def pilot(image: Image) -> Pilot:
    flash = memoryview(bytearray(prepared_flash(image, lines=("set mission_fly=1",))))
    pilot = Pilot(FlyingNaze(image, flash, place=PLACE))
    pilot.power_on()
    try:
        require_mission_flight(pilot.console, "the image")
    except UnfitImageError as error:
        pytest.skip(f"NOT RUN: {error}")
    return pilot


def set_out(pilot: Pilot, records: list[WpRecord], wind: float, kilograms: float, seed: int, lies: Lies) -> None:
    """The craft on the ground at the launch place, disarmed, with a list."""
    faults, naze = pilot.naze.faults, pilot.naze
    faults.roll = MIDDLE
    faults.throttle = faults.aux2 = faults.aux3 = faults.aux4 = LOW
    faults.radio = faults.gps_fix = True
    faults.armed = False
    naze.sky.set_out(Weather(wind=wind, seed=seed), Airframe().scaled(kilograms), lies)
    pilot.wait_until(lambda: not naze.armed, "disarming")
    naze.sky.set_out(Weather(wind=wind, seed=seed), Airframe().scaled(kilograms), lies)
    pilot.wait(SETTLE_S)
    pilot.track = Track()
    upload(pilot.console, records)


def story(pilot: Pilot, run: MissionRun) -> str:
    found = extremes(run, PLACE)
    ending = run.last.state.name.lower() if pilot.naze.armed else "disarmed"
    limits = f"{found.off_legs_m:.1f} m off, {found.fastest:.1f} m/s, {found.steepest_deg:.0f} degrees"
    compass = "" if run.last.compass is None else f", compass {run.last.compass:.0f} off"
    return f"{ending}, {run.reason.name.lower()}; {limits}{compass}"


@pytest.mark.parametrize(
    ("number", "compass", "wind", "kilograms"),
    [(n, *each) for n, each in enumerate(product((0, 15, 30, 45), (0.0, 5.0, 8.0), (0.5, 1.0, 2.0)))],
)
def test_a_mission_is_flown(
    pilot: Pilot, figure: Figure, number: int, compass: int, wind: float, kilograms: float
) -> None:
    records = LISTS[(number + number // 3) % 3]
    lag = 0.5 if compass == 45 else 0.2 + 0.1 * (number % 3)
    set_out(pilot, records, wind, kilograms, number, Lies(compass=compass * (-1) ** number, gps_lag=lag))
    run = fly_mission(pilot, records)
    results = judge(run, PLACE)
    problems = [f"{result.number} {result.command}: {text}" for result in results for text in result.problems]
    figure(
        f"compass {compass}, {wind:.0f} m/s, {kilograms:g} kg, {len(records)} records",
        f"{'flown' if is_flown(results) else 'NOT FLOWN'}: {story(pilot, run)}; {'; '.join(problems)}",
    )
    assert run.has_ended
    assert not extremes(run, PLACE).problem
    assert is_flown(results), problems


@pytest.mark.parametrize("number", range(12))
def test_a_worn_craft_flies_a_mission(pilot: Pilot, figure: Figure, number: int) -> None:
    """Three times the vibration, a motor with 85 % of its thrust, a barometer that drifts, in up to 8 m/s."""
    lies = (Lies(vibration=3.0), Lies(weak_motor=0.85), Lies(baro_drift=0.03), Lies(baro_drift=-0.03))[number % 4]
    wind, records = (0.0, 5.0, 8.0)[number // 4], LISTS[number % 3]
    set_out(pilot, records, wind, 1.0, 100 + number, lies)
    run = fly_mission(pilot, records)
    problems = [f"{result.number} {result.command}: {text}" for result in judge(run, PLACE) for text in result.problems]
    figure(f"{lies}, {wind:.0f} m/s", f"{story(pilot, run)}; {'; '.join(problems)}")
    assert run.has_ended
    assert not extremes(run, PLACE).problem
    assert run.reason in (FlightReason.NONE, FlightReason.FLOWN, FlightReason.DISARMED)
    heights = [problem for problem in problems if " m high" in problem]
    assert problems == heights if lies.baro_drift else not problems


def move_the_roll_stick(pilot: Pilot) -> None:
    pilot.naze.faults.roll = 1700
    pilot.wait(2.0)
    pilot.naze.faults.roll = MIDDLE


def switch_off_and_on(pilot: Pilot) -> None:
    pilot.fly_mission(False)
    pilot.wait(2.0)
    pilot.fly_mission()


def hide_the_sky(pilot: Pilot) -> None:
    pilot.naze.faults.gps_fix = False


def hide_the_sky_for_a_moment(pilot: Pilot) -> None:
    hide_the_sky(pilot)
    pilot.wait(6.0)
    pilot.naze.faults.gps_fix = True


def switch_the_transmitter_off(pilot: Pilot) -> None:
    pilot.naze.faults.radio = False


def call_it_home(pilot: Pilot) -> None:
    pilot.return_home()


def move_the_place(pilot: Pilot) -> None:
    pilot.naze.sky.lies.gps_jump = 15.0


@dataclass(frozen=True)
class Ending:
    """What an act leads to: a state, or disarmed; its reason; at most so far from home, m."""

    state: FlightPhase | None
    reason: FlightReason
    home_m: float | None = None


HELD_BY_STICKS = Ending(FlightPhase.HELD, FlightReason.STICKS)
HELD_WITHOUT_FIX = Ending(FlightPhase.HELD, FlightReason.FIX_LOST)
BLIND = Ending(None, FlightReason.BLIND)
FAILSAFE, RTL = Ending(None, FlightReason.FAILSAFE, 5.0), Ending(None, FlightReason.RTL, 5.0)
LANDED = Ending(None, FlightReason.DISARMED)
JUMPED = Ending(FlightPhase.HELD, FlightReason.JUMP)
DONE = Ending(FlightPhase.DONE, FlightReason.FLOWN)
LEG, LOITER, WHILE_TURNING, DESCENT = FlightPhase.LEG, FlightPhase.LOITER, FlightPhase.TURN, FlightPhase.DESCENT


@pytest.mark.parametrize(
    ("number", "act", "state", "which", "ending"),
    [
        (number, *each)
        for number, each in enumerate(
            [
                (move_the_roll_stick, LEG, 0, HELD_BY_STICKS),
                (move_the_roll_stick, LOITER, 0, HELD_BY_STICKS),
                (move_the_roll_stick, DESCENT, 2, HELD_BY_STICKS),
                (switch_off_and_on, LEG, 0, DONE),
                (hide_the_sky_for_a_moment, LEG, 0, HELD_WITHOUT_FIX),
                (hide_the_sky_for_a_moment, WHILE_TURNING, 1, HELD_WITHOUT_FIX),
                (hide_the_sky_for_a_moment, DESCENT, 2, LANDED),
                (hide_the_sky, LEG, 0, BLIND),
                (hide_the_sky, LOITER, 0, BLIND),
                (hide_the_sky, DESCENT, 2, LANDED),
                (switch_the_transmitter_off, LEG, 0, FAILSAFE),
                (switch_the_transmitter_off, WHILE_TURNING, 1, FAILSAFE),
                (switch_the_transmitter_off, DESCENT, 2, LANDED),
                (call_it_home, LEG, 0, RTL),
                (call_it_home, LOITER, 0, RTL),
                (move_the_place, LEG, 0, JUMPED),
                (move_the_place, LOITER, 0, JUMPED),
                (move_the_roll_stick, LEG, 1, HELD_BY_STICKS),
                (hide_the_sky_for_a_moment, LOITER, 0, HELD_WITHOUT_FIX),
                (hide_the_sky, WHILE_TURNING, 1, BLIND),
                (switch_the_transmitter_off, LOITER, 0, FAILSAFE),
                (call_it_home, WHILE_TURNING, 1, RTL),
                (switch_the_transmitter_off, LEG, 1, FAILSAFE),
                (call_it_home, LEG, 2, RTL),
            ]
        )
    ],
)
def test_a_flight_is_interrupted(
    pilot: Pilot,
    figure: Figure,
    number: int,
    act: Callable[[Pilot], None],
    state: FlightPhase,
    which: int,
    ending: Ending,
) -> None:
    wind, kilograms, compass = (
        (0.0, 5.0, 8.0)[number % 3],
        (1.0, 2.0, 0.5)[number // 3 % 3],
        (0, 20, -30)[number // 2 % 3],
    )
    set_out(pilot, LISTS[which], wind, kilograms, number, Lies(compass=compass))
    has_acted: list[float] = []

    def intervene(pilot: Pilot, progress: FlightProgress) -> None:
        begun = progress.state is state and progress.state_s > 1.5 and (state is not LEG or (progress.record or 0) > 1)
        if begun and not has_acted:
            has_acted.append(pilot.now)
            act(pilot)

    run = fly_mission(pilot, LISTS[which], intervene)
    away = pilot.track.last.distance_to((0.0, 0.0))
    what = f"{act.__name__.replace('_', ' ')} in {state.name.lower()}"
    figure(
        f"{what}, {wind:.0f} m/s, {kilograms:g} kg, compass {compass}",
        f"{story(pilot, run)}, {away:.1f} m from home",
    )
    assert has_acted
    assert not extremes(run, PLACE).problem
    assert pilot.naze.armed is (ending.state is not None)
    assert ending.state in (None, run.last.state)
    reasons = {report.progress.reason for report in run.reports if report.at_s > has_acted[0]}
    assert ending.reason in reasons
    assert ending.home_m is None or away < ending.home_m
