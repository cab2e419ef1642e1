# SPDX-License-Identifier: GPL-3.0-or-later
"""The states of a line that carries MAVLink: a Harakiri's, which the bridge represents, or an autopilot's own."""

from abc import abstractmethod

from bridge.fc.mavlink_telemetry import MavlinkTelemetry
from bridge.fc.profile import FlightController
from bridge.fc.states.base import Event, FcLine, Found, Lost, State
from bridge.line.msp_link import PROBE, byte_time_s
from bridge.model.vehicle import FlightState, Source
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkSplitter, kinds
from protocols.msp.frame import MspParser

#: Two lost heartbeats.
_SILENCE_S = 2.5
#: An incomplete frame is dropped after this long without a byte.
_LINE_SILENCE_S = 0.1
#: Armed it sends the attitude 30 times a second: when that ends, it has disarmed and changed the speed.
_ARMED_SILENCE_S = 0.8
#: A stream of 1600 bytes a second overruns Harakiri's send ring on a slow line, so most frames are torn: before it
#: counts as lost, this many bytes may pass without a whole one. At 2400 baud whole ones come up to 3.5 s apart. At 1200
#: baud there is one in 40 s: no deadline would help.
_BYTES_BEFORE_LOSS = 1000
#: It is probed for MSP, which it answers again once it is disarmed.
_PROBE_INTERVAL_S = 1.0


class MavlinkLine(State):
    """The flight controller speaks MAVLink."""

    name = "MAVLink"
    controller: FlightController

    def __init__(self, fc_line: FcLine, event: Found, now: float) -> None:
        super().__init__(fc_line, event, now)
        self.controller = fc_line.controller_that_speaks(event.spoken)
        self._splitter = MavlinkSplitter()
        self._heard_at = self._last_byte_at = now
        self._look_at = now + _LINE_SILENCE_S

    @property
    def bad_checksums(self) -> int | None:
        return self._splitter.bad_frames

    def receive(self, data: bytes, now: float, *, is_end: bool = False) -> Event | None:
        """`is_end`: an incomplete frame is dropped."""
        self._last_byte_at = now
        frames = self._splitter.split(data, is_end=is_end)
        if frames:
            self._heard_at = now
            self.take(frames, now)
        return None

    def tick(self, now: float) -> Event | None:
        event = None
        if self._splitter.is_waiting and now >= self._last_byte_at + _LINE_SILENCE_S:
            # A false header may hide frames.
            event = self.receive(b"", now, is_end=True)
        # Checked ten times a second rather than after each byte: a timer per byte would cost more than the frames.
        self._look_at = now + _LINE_SILENCE_S
        if now >= self._heard_at + self.timeout_s:
            return Lost(f"no MAVLink for {self.timeout_s:.1f} s")
        return event

    @property
    def due(self) -> float:
        silent_at = self._heard_at + self.timeout_s
        return min(silent_at, self._look_at) if self._splitter.is_waiting else silent_at

    @property
    def timeout_s(self) -> float:
        """The silence after which the flight controller is lost, s."""
        return _SILENCE_S

    @abstractmethod
    def take(self, frames: list[bytes], now: float) -> None:
        """Handle frames of the flight controller."""


class PassThrough(MavlinkLine):
    """The autopilot gets only the frames of ground stations, and the bridge does not send in its name."""

    def __init__(self, fc_line: FcLine, event: Found, now: float) -> None:
        super().__init__(fc_line, event, now)
        self.telemetry = MavlinkTelemetry(self.controller.profile.mavlink_readings(fc_line.vehicle))
        fc_line.meet(self.controller)
        assert event.heard is not None
        heard = [event.heard.raw]
        self.telemetry.take(heard, kinds(heard), now)

    def take(self, frames: list[bytes], now: float) -> None:
        their_kinds = kinds(frames)
        self.telemetry.take(frames, their_kinds, now)
        self.fc_line.on_mavlink(frames, their_kinds)


class HarakiriMavlink(MavlinkLine):
    """A Harakiri that speaks MAVLink. The bridge represents it, and sends only probes for MSP."""

    def __init__(self, fc_line: FcLine, event: Found, now: float) -> None:
        super().__init__(fc_line, event, now)
        self._telemetry = MavlinkTelemetry(self.controller.profile.mavlink_readings(fc_line.vehicle))
        fc_line.meet(self.controller)
        self._msp = MspParser()
        self._probe_due = now + _PROBE_INTERVAL_S
        assert event.heard is not None
        if event.heard.msgid != messages.MAVLINK_MSG_ID_HEARTBEAT:
            # Unprompted, it sends more than heartbeats only while armed.
            fc_line.vehicle.hear(FlightState(now, Source.MAVLINK, True))
        heard = [event.heard.raw]
        self._telemetry.take(heard, kinds(heard), now)

    def receive(self, data: bytes, now: float, *, is_end: bool = False) -> Event | None:
        if self._msp.feed(data):
            return Lost("it answers MSP again", (self.speed,))
        return super().receive(data, now, is_end=is_end)

    def tick(self, now: float) -> Event | None:
        event = super().tick(now)
        if event is None and now >= self._probe_due:
            self._probe_due = now + _PROBE_INTERVAL_S
            self.fc_line.output.append(PROBE)
        return event

    @property
    def due(self) -> float:
        return min(super().due, self._probe_due)

    def take(self, frames: list[bytes], now: float) -> None:
        was_armed = self.fc_line.vehicle.armed
        self._telemetry.take(frames, kinds(frames), now)
        if was_armed and not self.fc_line.vehicle.armed:
            self._probe_due = now

    @property
    def timeout_s(self) -> float:
        if not self.fc_line.vehicle.armed:
            return super().timeout_s
        return _ARMED_SILENCE_S + _BYTES_BEFORE_LOSS * byte_time_s(self.speed)
