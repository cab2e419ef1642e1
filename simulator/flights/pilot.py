# SPDX-License-Identifier: GPL-3.0-or-later
"""A pilot at the transmitter of an emulated board in the sky, with the switches of `prepared_flash`.

The pilot knows the craft's true position, but has only sticks and switches.
"""

from collections.abc import Callable
from math import hypot

from simulator.emulated_naze.console import Console
from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.flights.track import Track

LOW, MIDDLE, HIGH = 1000, 1500, 2000
#: From power on to the first reply, with a GPS module: at most.
_BOOT_S = 40.0
#: After that, until height and position are known.
_SETTLE_S = 6.0
_CLIMB, _HOVER, _FORWARD = 1620, 1500, 1620
_STEP_S = 0.1
_DEADLINE_S = 60.0


class PilotError(Exception):
    """The craft did not follow the pilot; one sentence."""


class Pilot:
    """Powers the craft on, and flies it by hand."""

    def __init__(self, naze: FlyingNaze) -> None:
        self.naze = naze
        self.track = Track()
        self.console = Console(naze, on_time=lambda now: self.track.note(now, naze))

    @property
    def now(self) -> float:
        return self.console.now

    @property
    def height(self) -> float:
        """Metres."""
        return self.naze.sky.body.position[2]

    def wait(self, seconds: float) -> None:
        self.console.run(seconds)

    def wait_until(self, happened: Callable[[], bool], what: str, deadline_s: float = _DEADLINE_S) -> float:
        """The seconds it took. PilotError."""
        begun = self.now
        while not happened():
            if self.now > begun + deadline_s:
                raise PilotError(f"{what}: not within {deadline_s:.0f} s")
            self.wait(_STEP_S)
        return self.now - begun

    def power_on(self) -> None:
        """Switch on, and wait until it can be armed. ConsoleError."""
        self.naze.power_on(self.now)
        self.console.wait_for_boot(_BOOT_S)
        self.wait(_SETTLE_S)

    def arm(self) -> None:
        """With height and position hold off, as the firmware demands. PilotError."""
        switches = self.naze.faults
        switches.aux1, switches.aux2, switches.throttle = HIGH, LOW, LOW
        switches.armed = True
        self.wait_until(lambda: self.naze.armed, "arming", 8.0)
        self.wait(0.5)

    def take_off(self, height: float) -> None:
        """Climb by hand in level flight, then hold height and place. PilotError."""
        switches = self.naze.faults
        switches.throttle = _CLIMB
        self.wait_until(lambda: self.height > height - 1.5, f"climbing to {height:.0f} m")
        switches.throttle = _HOVER
        self.wait(0.3)
        switches.aux2 = HIGH
        self.wait(4.0)

    def hold(self, *, place: bool = True) -> None:
        """Hold the height, and the place too."""
        self.naze.faults.throttle = _HOVER
        self.naze.faults.aux2 = HIGH if place else MIDDLE

    def fly_forward(self, metres: float) -> None:
        """Fly forward until this far from the launch place, then hold. PilotError."""
        switches = self.naze.faults
        self.hold(place=False)
        switches.pitch = _FORWARD
        self.wait_until(lambda: hypot(*self.naze.sky.body.position[:2]) > metres, f"flying {metres:.0f} m")
        switches.pitch = MIDDLE
        self.hold()

    def return_home(self) -> None:
        self.naze.faults.aux3 = HIGH

    def fly_mission(self, is_on: bool = True) -> None:
        """The switch GPSAUTO."""
        self.naze.faults.aux4 = HIGH if is_on else LOW
