# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole missions of all commands, flown by the real image with mission flight in the simulated sky.

make real-board IMAGE=X.elf FLY=1 (MISSIONS=6: fewer of each wind). The image must be built with apply --flight.
"""

import os
import random
from collections.abc import Callable
from itertools import count

import pytest

from protocols.firmware_image import Image
from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.mission_flight import FlightPhase, FlightProgress, FlightReason
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.prepared_flash import prepared_flash
from simulator.flights.judgement import is_flown, judge
from simulator.flights.mission_run import MissionRun, fly_mission
from simulator.flights.mission_upload import UnfitImageError, require_mission_flight, upload
from simulator.flights.pilot import MIDDLE, Pilot
from simulator.sky.earth import Place
from simulator.sky.sky import Weather
from tests.support.real_bench import Figure

pytestmark = pytest.mark.skipif(not os.environ.get("NAZE_FLY"), reason="NOT RUN: takes an hour: make real-board FLY=1")
PLACE = Place()
MISSIONS = int(os.environ.get("NAZE_MISSIONS") or 14)
#: Nothing may be farther from all places of its list.
FLYAWAY_M = 40.0


def ready(image: Image, wind: float, seed: int, records: list[WpRecord]) -> Pilot:
    flash = prepared_flash(image, lines=("set mission_fly=1",))
    pilot = Pilot(FlyingNaze(image, memoryview(bytearray(flash)), weather=Weather(wind=wind, seed=seed), place=PLACE))
    pilot.power_on()
    try:
        require_mission_flight(pilot.console, "the image")
    except UnfitImageError as error:
        pytest.skip(f"NOT RUN: {error}")
    upload(pilot.console, records)
    return pilot


def record(command: WpCommand, place: tuple[float, float] | None, height: int = 0, **fields: int) -> WpRecord:
    lat, lon = PLACE.coordinates((*place, 0.0)) if place else (0.0, 0.0)
    return WpRecord(round(lat * 1e7), round(lon * 1e7), height, 0, 0, 2, 0, command)._replace(**fields)


def random_mission(seed: int) -> list[WpRecord]:
    """A legal list of 3 to 6 records behind the home point, legs up to 60 m."""
    chance = random.Random(f"missions {seed}")
    places = [(0.0, 0.0)]

    def somewhere() -> tuple[float, float]:
        north, west = places[-1]
        places.append((chance.uniform(-40, 40), chance.uniform(-40, 40)))
        return places[-1] if abs(places[-1][0] - north) + abs(places[-1][1] - west) > 15 else somewhere()

    records = [record(WpCommand.WAYPOINT, (0.0, 0.0))]
    if chance.random() < 0.6:
        records.append(record(WpCommand.TAKEOFF, None, chance.randint(4, 10)))
    has_roi = False
    for _ in range(chance.randint(2, 4)):
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
    match chance.randrange(3):
        case 0:
            records.append(record(WpCommand.LOITER_UNLIM, somewhere(), 8))
        case 1:
            records.append(record(WpCommand.RETURN_TO_LAUNCH, None, 8))
        case _:
            records += [record(WpCommand.RETURN_TO_LAUNCH, None, 8), record(WpCommand.LAND, None)]
    return records


def farthest(run: MissionRun) -> float:
    """From the nearest place of its list, m."""
    places = [PLACE.position(r.lat_e7 / 1e7, r.lon_e7 / 1e7) for r in run.records if r.lat_e7] + [(0.0, 0.0)]
    return max(min(sample.distance_to(place) for place in places) for sample in run.track)


@pytest.mark.parametrize("seed", range(MISSIONS))
@pytest.mark.parametrize("wind", [0.0, 5.0, 8.0])
def test_a_mission_is_flown(image: Image, figure: Figure, wind: float, seed: int) -> None:
    """In calm air as the document says; in wind it may stop, but never flies away."""
    records = random_mission(seed)
    pilot = ready(image, wind, seed, records)
    run = fly_mission(pilot, records)
    results = judge(run, PLACE)
    problems = [f"{result.number} {result.command}: {text}" for result in results for text in result.problems]
    names = " ".join(WpCommand(each.command).name for each in records[1:])
    figure(f"{wind:.0f} m/s, mission {seed}", f"{names}: {'; '.join(problems) or 'flown'}")
    assert run.has_ended
    assert farthest(run) < FLYAWAY_M
    if not wind:
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


def roll(pilot: Pilot) -> None:
    pilot.naze.faults.roll = 1700


def switch_off(pilot: Pilot) -> None:
    pilot.fly_mission(False)


def hide_the_sky(pilot: Pilot) -> None:
    pilot.naze.faults.gps_fix = False


def transmitter_off(pilot: Pilot) -> None:
    pilot.naze.faults.radio = False


def go_home(pilot: Pilot) -> None:
    pilot.return_home()


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        (roll, FlightReason.STICKS),
        (switch_off, FlightReason.SWITCHED_OFF),
        (hide_the_sky, FlightReason.FIX_LOST),
        (transmitter_off, FlightReason.FAILSAFE),
        (go_home, FlightReason.RTL),
    ],
)
def test_the_pilot_and_trouble_end_a_flight(
    image: Image, figure: Figure, act: Callable[[Pilot], None], reason: FlightReason
) -> None:
    pilot = ready(image, 0.0, 1, LINE)
    is_time = in_the_second_leg()

    def intervene(pilot: Pilot, progress: FlightProgress) -> None:
        if is_time(progress):
            act(pilot)
            pilot.naze.faults.throttle = MIDDLE

    run = fly_mission(pilot, LINE, intervene)
    figure(f"{act.__name__.replace('_', ' ')} in a leg", f"{run.last.state.name}, {run.reason.name}")
    assert run.reason is reason
    assert farthest(run) < FLYAWAY_M
