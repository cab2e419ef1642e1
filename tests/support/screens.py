# SPDX-License-Identifier: GPL-3.0-or-later
"""The screens of Mission Planner and QGroundControl, both fed by one station of a simulated world.

screens = Screens(station)
world.power_off()
for glance in screens.look():
    assert glance.hud.startswith("Flight controller lost")
"""

from dataclasses import dataclass

from protocols.mavlink.dialect import Message
from tests.support.mission_planner_screen import MissionPlannerScreen
from tests.support.qgc_screen import QgcScreen
from tests.support.world import GroundStation

#: Mission Planner shows a line that is set once for 10 s; after 30 s only repeated ones are left.
LOOKS_S = (1.0, 9.0, 30.0)


@dataclass(frozen=True, slots=True)
class Glance:
    """The texts on both screens at one moment.

    Mission Planner: the line on the HUD, armed, FAILSAFE, SAFE, the mode, "Ready to Arm" (only shown while disarmed).
    QGroundControl: the status at the left of its toolbar, the reason not to arm over the map.
    """

    at: float
    hud: str
    armed: bool
    failsafe: bool
    safe: bool
    mode: str
    ready_to_arm: bool
    qgc: str
    qgc_reason: str


class Screens:
    """Fed by a station of a world, also with all that it has received before. From now on the station is connected."""

    def __init__(self, station: GroundStation) -> None:
        self.mission_planner = MissionPlannerScreen()
        self.qgc = QgcScreen()
        self._world = station.world
        for at, message in station.received:
            self._take(at, message)
        station.on_message.append(lambda message: self._take(self._world.now, message))
        station.stay_connected()

    def glance(self) -> Glance:
        """What the pilot reads now."""
        now, planner = self._world.now, self.mission_planner
        return Glance(
            now,
            planner.hud(now),
            planner.armed.at(now),
            planner.failsafe.at(now),
            planner.safe.at(now),
            planner.mode.at(now),
            planner.ready.at(now),
            self.qgc.status(now),
            self.qgc.prearm_error.at(now),
        )

    def look(self, *after_s: float) -> list[Glance]:
        """Let time pass, and look after these seconds from now, by default after 1, 9 and 30."""
        began, glances = self._world.now, []
        for after in after_s or LOOKS_S:
            self._world.run(began + after - self._world.now)
            glances.append(self.glance())
        return glances

    def _take(self, at: float, message: Message) -> None:
        self.mission_planner.take(at, message)
        self.qgc.take(at, message)
