# SPDX-License-Identifier: GPL-3.0-or-later
"""The image flies by its own functions in the simulated sky: this proves the craft, before any mission is judged in it.

Needs TestCode3, patched or not: HarakiriWebstore1 has no GPS code. make real-board IMAGE=X.elf FLY=1
"""

import os
from contextlib import suppress

import pytest

from protocols.msp.commands import Msp
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.prepared_flash import prepare, prepared_flash
from simulator.flights.mission_upload import UnfitImageError, require_mission_flight
from simulator.flights.pilot import HIGH, Pilot
from simulator.sky.body import Airframe
from simulator.sky.sky import Weather
from tests.support.real_bench import Figure

pytestmark = pytest.mark.skipif(not os.environ.get("NAZE_FLY"), reason="NOT RUN: takes minutes: make real-board FLY=1")
LAUNCH = (0.0, 0.0)


def ready(image: Image, wind: float = 0.0, seed: int = 1, factor: float = 1.0, *settings: str) -> Pilot:
    """Powered on, and calibrated."""
    flash = prepare(image, settings) if settings else prepared_flash(image)
    frame = Airframe().scaled(factor)
    naze = FlyingNaze(image, memoryview(bytearray(flash)), weather=Weather(wind=wind, seed=seed), frame=frame)
    pilot = Pilot(naze)
    pilot.power_on()
    return pilot


@pytest.mark.parametrize(("wind", "limit"), [(0.0, 0.05), (5.0, 0.12)])
def test_it_holds_the_height(image: Image, figure: Figure, wind: float, limit: float) -> None:
    pilot = ready(image, wind)
    pilot.arm()
    pilot.take_off(10.0)
    pilot.hold(place=False)
    pilot.wait(5.0)
    begun = pilot.now
    pilot.wait(20.0)
    flown = pilot.track.since(begun)
    figure(f"height hold in {wind:.0f} m/s, rms", f"{flown.height_rms():.3f} m")
    assert flown.height_rms() < limit


@pytest.mark.parametrize("factor", [1.0, 2.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_it_holds_the_place_in_wind(image: Image, figure: Figure, seed: int, factor: float) -> None:
    pilot = ready(image, 5.0, seed, factor)
    pilot.arm()
    pilot.take_off(10.0)
    pilot.wait(12.0)
    begun = pilot.now
    pilot.wait(60.0)
    flown = pilot.track.since(begun)
    rms, largest = flown.distances(flown.middle)
    figure(f"place hold in 5 m/s, {factor:.0f} kg, seed {seed}", f"rms {rms:.2f}, largest {largest:.2f} m")
    assert rms < 2.2
    assert largest < 4.5


def test_it_returns_and_lands(image: Image, figure: Figure) -> None:
    pilot = ready(image)
    pilot.arm()
    pilot.take_off(10.0)
    pilot.fly_forward(60.0)
    pilot.wait(12.0)
    begun = pilot.now
    pilot.return_home()
    arrived = pilot.wait_until(lambda: pilot.track.last.distance_to(LAUNCH) < 4.0, "the way home", 90.0)
    pilot.wait_until(lambda: not pilot.naze.armed, "landing", 90.0)
    away = pilot.track.last.distance_to(LAUNCH)
    figure(
        "return from 60 m", f"there after {arrived:.0f} s, disarmed after {pilot.now - begun:.0f} s, {away:.1f} m off"
    )
    assert pilot.height == 0.0
    assert away < 5.0
    assert pilot.naze.sky.body.touch_down_speed < 1.5


def test_autostart_takes_it_up(image: Image, figure: Figure) -> None:
    pilot = ready(image, 0.0, 1, 1.0, "set as_trgt=5")
    pilot.arm()
    pilot.naze.faults.aux2 = HIGH
    pilot.wait(1.0)
    pilot.hold()
    pilot.wait(25.0)
    figure("Autostart to 5 m", f"{pilot.height:.2f} m")
    assert pilot.height == pytest.approx(5.0, abs=1.0)


def test_a_lost_transmitter_brings_it_down(image: Image, figure: Figure) -> None:
    """fs_delay 1 s, then home and down."""
    pilot = ready(image)
    pilot.arm()
    pilot.take_off(8.0)
    pilot.wait(10.0)
    begun = pilot.now
    pilot.naze.faults.radio = False
    pilot.wait_until(lambda: not pilot.naze.armed, "failsafe's landing", 120.0)
    figure("failsafe from 8 m", f"disarmed after {pilot.now - begun:.0f} s")
    assert pilot.height == 0.0


def test_the_main_loop_has_time(image: Image, figure: Figure) -> None:
    """At full speed, by the board's own measurement: the emulator counts the code's bytes, so single loops differ."""
    pilot = ready(image, 5.0, 1, 1.0, "set looptime=1000", "set mission_fly=1")

    def loops(what: str, seconds: float) -> None:
        times = []
        for _ in range(round(seconds / 0.1)):
            pilot.wait(0.1)
            if (reply := pilot.console.ask(Msp.STATUS)) is not None:
                times.append(int.from_bytes(reply[:2], "little"))
        figure(f"main loop, {what}", f"mean {sum(times) / len(times):.0f} us, longest {max(times)} us")
        assert max(times) < 3000

    pilot.arm()
    pilot.take_off(10.0)
    pilot.wait(8.0)
    loops("place hold in 5 m/s", 10.0)
    with suppress(UnfitImageError):
        require_mission_flight(pilot.console, "the image")
        pilot.fly_mission()  # the list is empty, so the flight steers a hold
        loops("mission flight holds its place in 5 m/s", 10.0)
        pilot.fly_mission(False)
    pilot.return_home()
    loops("way home", 10.0)
