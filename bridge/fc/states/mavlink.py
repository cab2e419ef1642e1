# SPDX-License-Identifier: GPL-3.0-or-later
"""A line that carries MAVLink: common to a Harakiri and to an autopilot that is passed through."""

from abc import abstractmethod

from bridge.fc.profile import FlightController
from bridge.fc.states.base import Event, Found, Lost, Port, State
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter, is_autopilot_heartbeat

#: Two lost heartbeats.
_SILENCE_S = 2.5
#: An incomplete frame is dropped after this long without a byte.
_LINE_SILENCE_S = 0.1
#: Heartbeats of one autopilot, and of no other in between, that outweigh the one frame, perhaps damaged, by which the
#: state was chosen. Those closer together than `_BEAT_S` count as one: every autopilot sends one a second.
_STEADY_BEATS, _BEAT_S = 5, 0.7
#: The size of a heartbeat's frame: MAVLink 1, MAVLink 2, and signed.
_HEARTBEAT_SIZES = (17, 21, 34)


class MavlinkLine(State):
    """The flight controller speaks MAVLink."""

    name = "MAVLink"
    controller: FlightController

    def __init__(self, port: Port, event: Found, now: float) -> None:
        super().__init__(port, event, now)
        self._spoken = event.spoken
        (profile,) = (profile for profile in port.profiles if profile.spoken is event.spoken)
        self.controller = FlightController(profile, profile.name)
        self._splitter = MavlinkSplitter()
        self._heard_at = self._last_byte_at = now
        self._look_at = now + _LINE_SILENCE_S
        self._beating, self._beats, self._beat_at = (0, 0), 0, now

    @property
    def bad_checksums(self) -> int | None:
        return self._splitter.bad_frames

    def receive(self, data: bytes, now: float) -> Event | None:
        self._last_byte_at = now
        return self._take(self._splitter.feed(data), now)

    def tick(self, now: float) -> Event | None:
        """Notice silence."""
        event = None
        if self._splitter.is_waiting and now >= self._last_byte_at + _LINE_SILENCE_S:
            # Frames may be hidden behind a false header.
            event = self._take(self._splitter.reset(), now)
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
    def take(self, frames: list[MavlinkFrame], now: float) -> None:
        """Handle frames of the flight controller."""

    def _take(self, frames: list[MavlinkFrame], now: float) -> Found | None:
        if not frames:
            return None
        self._heard_at = now
        self.take(frames, now)
        return self._revision(frames, now)

    def _revision(self, frames: list[MavlinkFrame], now: float) -> Found | None:
        """The other state, if its flight controller is the only one heard."""
        for frame in frames:
            # Measured first: there may be thousands of frames a second.
            if len(frame.raw) not in _HEARTBEAT_SIZES or not is_autopilot_heartbeat(frame):
                continue
            if frame.sender != self._beating:
                self._beating, self._beats = frame.sender, 0
            elif now < self._beat_at + _BEAT_S:
                continue
            self._beats, self._beat_at = self._beats + 1, now
            spoken = self.port.mavlink_of(frame)
            if self._beats >= _STEADY_BEATS and spoken is not self._spoken:
                return Found(spoken, self.speed, f"heard only its heartbeats, {self._beats} in a row", frame)
        return None
