# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller speaks MAVLink."""

from bridge.fc.autosense import Found, Spoken
from bridge.fc.mavlink_telemetry import MavlinkTelemetry
from bridge.fc.profile import FlightController, Profile
from bridge.fc.states.base import Event, Lost, Port, State
from bridge.line.mavlink_line import MavlinkLine
from bridge.model.autopilot import Autopilot
from protocols.mavlink.frame import MavlinkFrame


class Mavlink(State):
    """The flight controller speaks MAVLink: an armed Harakiri, or an autopilot that represents itself."""

    name = "MAVLink"
    controller: FlightController

    def __init__(self, port: Port, event: Found, now: float) -> None:
        super().__init__(port, event, now)
        profile = self._profile(event.heard)
        self.controller = FlightController(profile, profile.name)
        port.meet(self.controller)
        self._line = MavlinkLine(is_harakiri=not profile.is_passed_through, now=now)
        self.telemetry = MavlinkTelemetry(port.vehicle, is_harakiri=not profile.is_passed_through)
        if not profile.is_passed_through:
            port.runner.mavlink_up(self._line)
        if event.heard is not None:
            self.telemetry.take([event.heard], now)

    @property
    def bad_checksums(self) -> int | None:
        """As the line counts them."""
        return self._line.bad_frames

    def receive(self, data: bytes, now: float) -> Event | None:
        """Take frames."""
        return self._take(self._line.receive(data, now), now)

    def tick(self, now: float) -> Event | None:
        """Ask a Harakiri for MSP now and then; notice silence."""
        return self._take(self._line.tick(now, is_conversing=self.port.runner.is_busy), now)

    def deadline(self) -> float:
        """The line's next deadline."""
        return self._line.next_deadline()

    def take_output(self) -> list[bytes]:
        """The line's own frames."""
        return self._line.take_output()

    def _take(self, frames: list[MavlinkFrame], now: float) -> Event | None:
        if frames:
            self.telemetry.take(frames, now)
            self.port.on_mavlink(frames)
            if self.port.runner.is_busy:
                for frame in frames:
                    self.port.runner.received_mavlink(frame, now)
        return Lost(self._line.ended) if self._line.ended else None

    def _profile(self, heard: MavlinkFrame | None) -> Profile:
        """A board met over MSP on this port stays in its family; otherwise the sender decides."""
        profiles = [profile for profile in self.port.profiles if profile.spoken is Spoken.MAVLINK]
        ours = [profile for profile in profiles if not profile.is_passed_through]
        (other,) = (profile for profile in profiles if profile.is_passed_through)
        if self.port.autopilot is Autopilot.OTHER:
            return other
        if self.port.autopilot is Autopilot.HARAKIRI:
            return ours[0]
        sender = None if heard is None else (heard.version, heard.sysid, heard.compid)
        known = (p for p in ours if p.family == self.port.met_family or p.mavlink_sender == sender)
        return next(known, other)
