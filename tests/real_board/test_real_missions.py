# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole missions of all commands, flown by the real image with mission flight in the simulated sky.

make real-board IMAGE=X.elf FLY=1 (MISSIONS=6: fewer in each wind). The image must be built with apply --flight.
"""

import os
import random
from collections.abc import Callable, Iterator
from itertools import count, pairwise, starmap

import pytest

from protocols.firmware_image import Image
from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.mission_flight import FlightPhase, FlightProgress, FlightReason
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.prepared_flash import prepared_flash
from simulator.flights.judgement import ItemResult, is_flown, judge
from simulator.flights.mission_run import MissionRun, fly_mission
from simulator.flights.mission_upload import UnfitImageError, require_mission_flight, upload
from simulator.flights.pilot import MIDDLE, Pilot
from simulator.sky.body import Airframe
from simulator.sky.earth import Place
from simulator.sky.sky import Weather
from tests.support.real_bench import Figure

pytestmark = pytest.mark.skipif(not os.environ.get("NAZE_FLY"), reason="NOT RUN: takes an hour: make real-board FLY=1")
PLACE = Place()
MISSIONS = int(os.environ.get("NAZE_MISSIONS") or 14)
#: Nothing may be farther from all legs of its list.
FLYAWAY_M = 40.0


def ready(image: Image, wind: float, seed: int, records: list[WpRecord]) -> Pilot:
    """The craft weighs 1 kg with even seeds, 2 kg with odd ones."""
    flash = memoryview(bytearray(prepared_flash(image, lines=("set mission_fly=1",))))
    weather, frame = Weather(wind=wind, seed=seed), Airframe().scaled(kilograms(seed))
    pilot = Pilot(FlyingNaze(image, flash, weather=weather, frame=frame, place=PLACE))
    pilot.power_on()
    try:
        require_mission_flight(pilot.console, "the image")
    except UnfitImageError as error:
        pytest.skip(f"NOT RUN: {error}")
    upload(pilot.console, records)
    return pilot


def kilograms(seed: int) -> int:
    return 1 + seed % 2


def record(command: WpCommand, place: tuple[float, float] | None, height: int = 0, **fields: int) -> WpRecord:
    lat, lon = PLACE.coordinates((*place, 0.0)) if place else (0.0, 0.0)
    return WpRecord(round(lat * 1e7), round(lon * 1e7), height, 0, 0, 2, 0, command)._replace(**fields)


def random_mission(seed: int) -> list[WpRecord]:
    """A legal list of 3 to 8 records behind the home point, legs up to 70 m."""
    chance = random.Random(f"missions {seed}")
    places = [(0.0, 0.0)]

    def somewhere() -> tuple[float, float]:
        north, west = places[-1]
        places.append((chance.uniform(-25, 25), chance.uniform(-25, 25)))
        return places[-1] if abs(places[-1][0] - north) + abs(places[-1][1] - west) > 15 else somewhere()

    records = [record(WpCommand.WAYPOINT, (0.0, 0.0))]
    if chance.random() < 0.6:
        records.append(record(WpCommand.TAKEOFF, None, chance.randint(4, 10)))
    has_roi = False
    for _ in range(chance.randint(2, 3)):
        if chance.random() < 0.25:
            records.append(record(WpCommand.SETROI, somewhere()))
            has_roi = True
        nose, height = int(has_roi and chance.random() < 0.5), chance.randint(5, 14)
        match chance.choice((WpCommand.WAYPOINT, WpCommand.LOITER_TIME, WpCommand.LOITER_TURNS)):
            case WpCommand.WAYPOINT:
                brake = chance.randint(0, 1)
                records.append(record(WpCommand.WAYPOINT, somewhere(), height, time=brake, roi_heading=nose))
            case WpCommand.LOITER_TIME:
                seconds = chance.randint(3, 15)
                records.append(record(WpCommand.LOITER_TIME, somewhere(), height, time=seconds, roi_heading=nose))
            case _:
                turns = chance.choice((-1, 1))
                records.append(record(WpCommand.LOITER_TURNS, somewhere(), height, turns=turns))
    match chance.randrange(4):
        case 0:
            records.append(record(WpCommand.LOITER_UNLIM, somewhere(), 8))
        case 1:
            records.append(record(WpCommand.RETURN_TO_LAUNCH, None, 8))
        case 2:
            records.append(record(WpCommand.LAND, None))
        case _:
            records += [record(WpCommand.RETURN_TO_LAUNCH, None, 8), record(WpCommand.LAND, None)]
    return records


def farthest(run: MissionRun) -> float:
    """From the nearest leg of its list, m."""
    places = [PLACE.position(r.lat_e7 / 1e7, r.lon_e7 / 1e7) if r.lat_e7 else (0.0, 0.0) for r in run.records]
    return max(min(starmap(sample.distance_to_leg, pairwise(places))) for sample in run.track)


def errors(results: list[ItemResult]) -> Iterator[str]:
    """The largest of each kind."""
    stays = [r for r in results if r.farthest_m is not None]
    kinds: dict[str, list[float | None]] = {
        "reached at": [r.distance_m for r in results if r.command != "LAND"],
        "overshoot": [r.overshoot_m for r in results],
        "stayed within": [r.farthest_m for r in stays],
        "height off by": [abs((r.height_m or 0) - (r.planned_height_m or 0)) for r in stays],
        "landed off by": [r.distance_m for r in results if r.command == "LAND"],
    }
    for name, values in kinds.items():
        if known := [value for value in values if value is not None]:
            yield f"{name} {max(known):.1f} m"


@pytest.mark.parametrize("wind", [0.0, 5.0, 8.0])
@pytest.mark.parametrize("seed", range(MISSIONS))
def test_a_mission_is_flown(image: Image, figure: Figure, wind: float, seed: int) -> None:
    records = random_mission(seed)
    pilot = ready(image, wind, seed, records)
    run = fly_mission(pilot, records)
    results = judge(run, PLACE)
    problems = [f"{result.number} {result.command}: {text}" for result in results for text in result.problems]
    names = " ".join(WpCommand(each.command).name for each in records[1:])
    found = "; ".join([*errors(results), *problems])
    figure(f"{wind:.0f} m/s, {kilograms(seed)} kg, mission {seed}", f"{names}: {found}")
    assert run.has_ended
    assert farthest(run) < FLYAWAY_M
    assert is_flown(results), problems


def in_the_second_leg() -> Callable[[FlightProgress], bool]:
    """True once, a while after the second leg began."""
    calls = count()
    return lambda progress: progress.state is FlightPhase.LEG and (progress.record or 0) > 1 and next(calls) == 15


LINE = [
    record(WpCommand.WAYPOINT, (0.0, 0.0)),
    record(WpCommand.WAYPOINT, (30.0, 0.0), 10, time=1),
    record(WpCommand.WAYPOINT, (30.0, -60.0), 10, time=1),
]


def move_the_roll_stick(pilot: Pilot) -> None:
    pilot.naze.faults.roll = 1700


def switch_off(pilot: Pilot) -> None:
    pilot.fly_mission(False)


def switch_off_and_on(pilot: Pilot) -> None:
    pilot.fly_mission(False)
    pilot.wait(2.0)
    pilot.fly_mission()


def hide_the_sky(pilot: Pilot) -> None:
    pilot.naze.faults.gps_fix = False


def hide_the_sky_for_a_moment(pilot: Pilot) -> None:
    hide_the_sky(pilot)
    pilot.wait(4.0)
    pilot.naze.faults.gps_fix = True


def switch_the_transmitter_off(pilot: Pilot) -> None:
    pilot.naze.faults.radio = False


def call_it_home(pilot: Pilot) -> None:
    pilot.return_home()


@pytest.mark.parametrize("wind", [0.0, 5.0, 8.0])
@pytest.mark.parametrize(
    ("seed", "act", "state", "reason"),
    [
        (1, move_the_roll_stick, FlightPhase.HELD, FlightReason.STICKS),
        (2, switch_off, FlightPhase.OFF, FlightReason.SWITCHED_OFF),
        (3, switch_off_and_on, FlightPhase.DONE, FlightReason.FLOWN),
        (4, hide_the_sky, FlightPhase.NO_FIX, FlightReason.FIX_LOST),
        (5, hide_the_sky_for_a_moment, FlightPhase.HELD, FlightReason.FIX_LOST),
        (6, switch_the_transmitter_off, FlightPhase.OFF, FlightReason.FAILSAFE),
        (7, switch_the_transmitter_off, FlightPhase.OFF, FlightReason.FAILSAFE),
        (8, call_it_home, FlightPhase.OFF, FlightReason.RTL),
        (9, call_it_home, FlightPhase.OFF, FlightReason.RTL),
    ],
)
def test_a_flight_is_interrupted(
    image: Image,
    figure: Figure,
    wind: float,
    seed: int,
    act: Callable[[Pilot], None],
    state: FlightPhase,
    reason: FlightReason,
) -> None:
    pilot = ready(image, wind, seed, LINE)
    is_time = in_the_second_leg()

    def intervene(pilot: Pilot, progress: FlightProgress) -> None:
        if is_time(progress):
            act(pilot)
            pilot.naze.faults.throttle = MIDDLE

    run = fly_mission(pilot, LINE, intervene)
    found = f"{run.last.state.name}, {run.reason.name}, {farthest(run):.1f} m from its list"
    if reason in (FlightReason.FAILSAFE, FlightReason.RTL):
        took_s = pilot.wait_until(lambda: not pilot.naze.armed, "the way home", 240.0)
        found += f", disarmed {took_s:.0f} s later, {pilot.track.last.distance_to((0.0, 0.0)):.1f} m from home"
    figure(f"{wind:.0f} m/s, {kilograms(seed)} kg, {act.__name__.replace('_', ' ')}", found)
    assert run.last.state is state
    assert run.reason is reason
    assert farthest(run) < FLYAWAY_M
