# SPDX-License-Identifier: GPL-3.0-or-later
"""The states of the line to a flight controller, their events, and the data that outlives them. Sans-IO.

Every state takes bytes and time, reports an event when it ends, and has a deadline: no state can wait forever.
`bridge.fc.session` has the table of which event leads where.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import ClassVar

from bridge.fc.profile import FlightController, Profile, Spoken
from bridge.line.msp_link import MspLink, PendingReplies
from bridge.line.poll_schedule import PollSchedule
from bridge.line.runner import Runner
from bridge.model.ground_track import GroundTrack
from bridge.model.vehicle import Vehicle
from bridge.voice.happening import Happening
from protocols.mavlink.frame import MavlinkFrame


@dataclass(frozen=True, slots=True)
class PortOpened:
    """The port is open."""


@dataclass(frozen=True, slots=True)
class PortClosed:
    """The port was lost. `why` is None if the bridge closed it itself."""

    why: str | None


@dataclass(frozen=True, slots=True)
class Found:
    """A protocol was heard on the line, and the evidence in words.

    `speed` in baud, None if the line has none. `heard`: a MAVLink frame. `pending`: replies that the board may still
    owe to the search.
    """

    spoken: Spoken
    speed: int | None
    why: str
    heard: MavlinkFrame | None = None
    pending: PendingReplies = field(default_factory=PendingReplies)


@dataclass(frozen=True, slots=True)
class Identified:
    """The board on an MSP link is known."""

    controller: FlightController
    found: Found
    link: MspLink


@dataclass(frozen=True, slots=True)
class Lost:
    """The line fell silent, or carries something else. `first`: speeds to try before all others."""

    why: str
    first: Sequence[int | None] = ()
    pending: PendingReplies = field(default_factory=PendingReplies)


Event = PortOpened | PortClosed | Found | Identified | Lost


@dataclass(slots=True)
class FcLine:
    """Everything that outlives a state: settings, knowledge about the port, and shared parts of the bridge.

    `on_mavlink` gets the MAVLink frames of a passed-through autopilot and their kinds (protocols.mavlink.frame).
    """

    speeds: Sequence[int | None]
    profiles: Sequence[Profile]
    runner: Runner
    on_mavlink: Callable[[list[bytes], list[bytes]], None]
    polls: PollSchedule = field(default_factory=PollSchedule)
    vehicle: Vehicle = field(default_factory=Vehicle)
    #: The bytes to be written to the port, in order.
    output: list[bytes] = field(default_factory=list)
    #: The speeds of the last two finds of the board, the older first: a Harakiri that arms may change the speed,
    #: and disarmed it comes back.
    good_speeds: deque[int | None] = field(default_factory=lambda: deque(maxlen=2))
    #: The family of the board that was last identified over MSP since the port was opened.
    met_family: str | None = None
    #: The family of the board that `vehicle` describes, which outlives a lost link and a change of protocol.
    family: str | None = None

    def controller_that_speaks(self, spoken: Spoken) -> FlightController:
        """The flight controller of a protocol that only one profile speaks."""
        (profile,) = (profile for profile in self.profiles if profile.spoken is spoken)
        return FlightController(profile, profile.name)

    def mavlink_of(self, frame: MavlinkFrame) -> Spoken:
        """A Harakiri's MAVLink or another autopilot's.

        A board met over MSP stays in its family unless it sends MAVLink 2. Otherwise the sender decides.
        """
        family = self.met_family if frame.version == 1 else None
        sender = frame.version, *frame.sender
        ours = (profile for profile in self.profiles if profile.spoken is Spoken.MAVLINK)
        is_ours = any(profile.family == family or profile.mavlink_sender == sender for profile in ours)
        return Spoken.MAVLINK if is_ours else Spoken.OTHER_MAVLINK

    def meet(self, controller: FlightController) -> None:
        """Begin a new vehicle if this is a different board."""
        if controller.profile.family != self.family:
            self.family = controller.profile.family
            self.vehicle.forget()
        # The craft may have turned while it was not heard.
        self.vehicle.track = GroundTrack()
        self.vehicle.airframe = controller.airframe or self.vehicle.airframe
        self.vehicle.version = controller.version or self.vehicle.version


class State(ABC):
    """One state. `receive` and `tick` return the event that ends it, or None."""

    name: ClassVar[str]
    #: The reason why the board cannot be used, and the remedy, or None if it can be.
    trouble: ClassVar[Happening | None] = None
    #: The flight controller on the line, or None until it is identified.
    controller: FlightController | None = None
    #: While MSP is spoken.
    link: MspLink | None = None
    #: True if the last bytes ended inside a frame without a change: slow lines deliver a reply in pieces.
    is_mid_frame: bool = False

    def __init__(self, fc_line: FcLine, event: Event, now: float) -> None:
        self.fc_line = fc_line
        #: The speed that the port must have, baud, or None where it has none.
        self.speed = event.speed if isinstance(event, Found) else None

    @abstractmethod
    def receive(self, data: bytes, now: float) -> Event | None:
        """Take bytes from the port."""

    @abstractmethod
    def tick(self, now: float) -> Event | None:
        """Run the timers."""

    @property
    @abstractmethod
    def due(self) -> float:
        """The time of the next `tick`; infinity only while the port is closed."""

    def unanswered(self) -> PendingReplies:
        """Replies that may still arrive: a stalled board sends them all at once when it resumes."""
        return PendingReplies()

    @property
    def bad_checksums(self) -> int | None:
        """Damaged frames since the flight controller was found, or None if that is not counted."""
        return None


class Closed(State):
    """The port is closed."""

    name = "no port"

    def receive(self, data: bytes, now: float) -> Event | None:
        """Bytes that were read before the port closed: dropped."""

    def tick(self, now: float) -> Event | None:
        """Without a timer."""

    @property
    def due(self) -> float:
        """Only opening the port ends this state."""
        return inf
