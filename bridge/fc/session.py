# SPDX-License-Identifier: GPL-3.0-or-later
"""The line to one flight controller: searched for, identified, polled, lost, searched for again. Sans-IO.

`TRANSITIONS` is the whole state machine; `bridge.fc.states` has a class for each state.
"""

from collections.abc import Callable, Mapping

from bridge.fc.profile import FlightController, Spoken
from bridge.fc.states.base import Closed, Event, FcLine, Found, Identified, Lost, PortClosed, PortOpened, State
from bridge.fc.states.mavlink import HarakiriMavlink, PassThrough
from bridge.fc.states.msp import Cli, Identifying, Polling
from bridge.fc.states.searching import Searching
from bridge.model.craft import FlightMemory
from bridge.model.events import Emit, FcFound, FcInCommandLine, FcLost, FcSensed, PortLost

_Next = Mapping[type[Event] | Spoken, type[State]]
_LOST: _Next = {Lost: Searching, PortClosed: Closed}
_MAVLINK: _Next = {Spoken.MAVLINK: HarakiriMavlink, Spoken.OTHER_MAVLINK: PassThrough}
_MSP: _Next = {Identified: Polling, **_MAVLINK, Spoken.CLI: Cli, **_LOST}
#: State -> event or search result -> next state. Any other event in a state is a bug.
TRANSITIONS: Mapping[type[State], _Next] = {
    Closed: {PortOpened: Searching},
    Searching: {Spoken.MSP: Identifying, **_MAVLINK, Spoken.CLI: Cli, **_LOST},
    Identifying: _MSP,
    Polling: _MSP,
    HarakiriMavlink: _LOST,
    PassThrough: _LOST,
    Cli: _LOST,
}


class FcSession:
    """Runs the state machine of one port.

    `on_change` is called with each flight controller that is found, and with None when it is lost or cannot be used.
    `flight`: of the craft that a previous bridge left armed.
    """

    def __init__(
        self,
        fc_line: FcLine,
        emit: Emit,
        on_change: Callable[[FlightController | None, float], None],
        flight: FlightMemory | None,
    ) -> None:
        self._fc_line = fc_line
        #: The flight controller's readings, kept when it is lost.
        self.vehicle = self._fc_line.vehicle
        self.polls = self._fc_line.polls
        #: The bytes to be written to the port at the state's `speed`, in order.
        self.output = self._fc_line.output
        self._emit = emit
        self._on_change = on_change
        if flight is not None:
            self._fc_line.family = flight.family
            self.vehicle.resume(flight)
        #: The current state, with the flight controller, the MSP link, and the speed that the port must have.
        self.state: State = Closed(self._fc_line, PortClosed(None), 0.0)

    @property
    def met_family(self) -> str | None:
        """The family of the board that was last identified over MSP since the port was opened."""
        return self._fc_line.met_family

    def flight_memory(self, now: float) -> FlightMemory | None:
        """The facts about an armed craft that a restarted bridge needs, or None unless it is armed."""
        family = self._fc_line.family
        return None if family is None else self.vehicle.memory(family, now)

    def opened(self, now: float) -> None:
        # Another board may have been connected.
        self._fc_line.met_family = None
        self.handle(PortOpened(), now)

    def closed(self, now: float, why: str | None) -> None:
        if isinstance(self.state, Closed):
            return
        self.handle(PortClosed(why), now)
        if why is not None:
            self._emit(PortLost(why=why))

    def restart(self, why: str, now: float) -> None:
        """Forget the flight controller and search again, after a fault in the bridge itself."""
        if not isinstance(self.state, Closed):
            self.handle(Lost(why, pending=self.state.unanswered()), now)

    def tick(self, now: float) -> None:
        event = self.state.tick(now)
        if event is not None:
            self.handle(event, now)

    def settle_telemetry(self) -> None:
        """Update the vehicle from the messages of a passed-through autopilot."""
        if isinstance(self.state, PassThrough):
            self.state.telemetry.settle()

    def send_mavlink(self, frame: bytes) -> None:
        """Pass a ground station's frame on to an autopilot that speaks MAVLink itself."""
        if isinstance(self.state, PassThrough):
            self._fc_line.output.append(frame)

    def handle(self, event: Event, now: float) -> None:
        """Go to the next state."""
        before = self.state
        after = TRANSITIONS[type(before)][event.spoken if isinstance(event, Found) else type(event)]
        if not isinstance(event, Identified):
            self._leave(before, event, now)
        self.state = after(self._fc_line, event, now)
        match event:
            case Found():
                self._emit(FcSensed(speed_baud=event.speed, protocol=event.spoken.value, why=event.why))
                self._welcome(event, now)
            case Identified(found=found):
                self._welcome(found, now)
        if self.state.trouble:
            self._on_change(None, now)
            self._emit(FcInCommandLine(speed_baud=self.state.speed))

    def _leave(self, state: State, event: Event, now: float) -> None:
        """Forget the flight controller and end the conversations with it."""
        self.state = Closed(self._fc_line, event, now)
        self._fc_line.output.clear()
        self._fc_line.runner.link_down(now)
        if state.trouble or state.controller is not None:
            self._on_change(None, now)
        if state.controller is not None and isinstance(event, Lost):
            self._emit(FcLost(why=event.why, speed_baud=state.speed))

    def _welcome(self, found: Found, now: float) -> None:
        controller = self.state.controller
        if controller is not None:
            self._emit(
                FcFound(
                    speed_baud=found.speed,
                    name=controller.name,
                    kind=controller.profile.name,
                    protocol=found.spoken.value,
                    why=found.why,
                )
            )
            self._on_change(controller, now)
