# SPDX-License-Identifier: GPL-3.0-or-later
"""The states of a line on which the flight controller does not answer: the command line, and FrSky telemetry."""

from bridge.fc.profile import FlightController
from bridge.fc.states.base import Event, Found, Lost, Port, State
from bridge.line.msp_link import PROBE
from bridge.model.vehicle import Source
from bridge.voice.sentences import IN_COMMAND_LINE
from protocols.frsky import FRSKY_SPEED, FrskyWatch
from protocols.mavlink.frame import MavlinkSplitter
from protocols.msp.command_line import RUB_OUT_LINE, typed_and_rubbed_out
from protocols.msp.frame import Direction, MspParser

#: A person may be typing: nothing is sent until the line has been quiet for this long, and then once in this time.
_QUIET_S = 3.0
#: Two requests without an echo: it is restarting, or has no power.
_SILENCE_S = 7.0
#: Harakiri sends FrSky telemetry eight times a second.
_FRSKY_SILENCE_S = 1.0
#: A Harakiri that receives requests also answers MSP.
_PROBE_INTERVAL_S = 5.0


class Cli(State):
    """The board was left in its command line, or a terminal program opened it.

    Sends only complete requests without a line end, and DEL, which erases them: so nothing precedes the pilot's `exit`,
    and nothing is executed. A reply or a heartbeat shows that it is back.
    """

    name = "command line"
    trouble = IN_COMMAND_LINE()

    def __init__(self, port: Port, event: Found, now: float) -> None:
        super().__init__(port, event, now)
        self._heard_at = self._sent_at = now
        self._begin_listening()
        port.output.append(RUB_OUT_LINE)

    def receive(self, data: bytes, now: float) -> Event | None:
        self._heard_at = now
        answers = [frame for frame in self._msp.feed(data) if frame.direction is not Direction.REQUEST]
        return Lost("it has left its command line") if answers or self._mavlink.feed(data) else None

    def tick(self, now: float) -> Event | None:
        if now >= self._heard_at + _SILENCE_S:
            return Lost("its command line no longer echoes")
        if now >= self._ask_at:
            self._sent_at = now
            self._begin_listening()
            self.port.output.append(typed_and_rubbed_out(PROBE))
        return None

    @property
    def due(self) -> float:
        return min(self._ask_at, self._heard_at + _SILENCE_S)

    @property
    def _ask_at(self) -> float:
        return max(self._heard_at, self._sent_at) + _QUIET_S

    def _begin_listening(self) -> None:
        # An echoed header hides what follows it from the parser.
        self._msp, self._mavlink = MspParser(), MavlinkSplitter()


class Frsky(State):
    """An armed Harakiri sends FrSky telemetry (tele_prot 1), and did not answer MSP."""

    name = "FrSky"
    controller: FlightController

    def __init__(self, port: Port, event: Found, now: float) -> None:
        super().__init__(port, event, now)
        self.controller = port.controller_that_speaks(event.spoken)
        self._frsky, self._msp = FrskyWatch(), MspParser()
        self._probe_due = now + _PROBE_INTERVAL_S
        port.meet(self.controller)
        self._note_armed(now)

    def receive(self, data: bytes, now: float) -> Event | None:
        self._frsky.feed(data)
        if self._frsky.values_in_a_row:
            self._note_armed(now)
        return Lost("it answers MSP again", (FRSKY_SPEED,)) if self._msp.feed(data) else None

    def _note_armed(self, now: float) -> None:
        self._heard_at = now
        self.port.hear_armed(Source.FRSKY, now)

    def tick(self, now: float) -> Event | None:
        if now >= self._probe_due:
            self._probe_due = now + _PROBE_INTERVAL_S
            self.port.output.append(PROBE)
        return (
            Lost(f"no FrSky telemetry for {_FRSKY_SILENCE_S} s") if now >= self._heard_at + _FRSKY_SILENCE_S else None
        )

    @property
    def due(self) -> float:
        return min(self._probe_due, self._heard_at + _FRSKY_SILENCE_S)
