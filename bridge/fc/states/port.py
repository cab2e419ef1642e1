# SPDX-License-Identifier: GPL-3.0-or-later
"""The data of a port that outlives its states."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from bridge.fc.profile import FlightController, Profile
from bridge.line.poll_schedule import PollSchedule
from bridge.line.runner import Runner
from bridge.model.autopilot import Autopilot
from bridge.model.ground_track import GroundTrack
from bridge.model.vehicle import Vehicle
from protocols.mavlink.frame import MavlinkFrame


@dataclass(slots=True)
class Port:
    """Everything that outlives a state: settings, knowledge about the port, and shared parts of the bridge."""

    speeds: Sequence[int | None]
    autopilot: Autopilot
    profiles: Sequence[Profile]
    runner: Runner
    on_mavlink: Callable[[list[MavlinkFrame]], None]
    polls: PollSchedule = field(default_factory=PollSchedule)
    vehicle: Vehicle = field(default_factory=Vehicle)
    output: list[bytes] = field(default_factory=list)
    #: A Harakiri that arms may change its speed; disarmed, it comes back to this one.
    known_speed: int | None = None
    #: The family of the board that was last identified over MSP on this port.
    met_family: str | None = None
    #: The family of the board that `vehicle` describes, which outlives a lost link and a change of protocol.
    family: str | None = None

    def meet(self, controller: FlightController) -> None:
        """Begin a new vehicle if this is another board than before."""
        if controller.profile.family != self.family:
            self.family = controller.profile.family
            self.vehicle.forget()
        # The craft may have turned while it was not heard.
        self.vehicle.track = GroundTrack()
        self.vehicle.airframe = controller.airframe or self.vehicle.airframe
        self.vehicle.version = controller.version or self.vehicle.version
