# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller speaks MAVLink."""

from math import inf

from bridge.fc.mavlink_telemetry import MavlinkTelemetry
from bridge.fc.profile import FlightController, Profile, Spoken
from bridge.fc.states.base import Event, Found, Lost, Port, State
from bridge.line.msp_link import PROBE, byte_time_s
from bridge.model.autopilot import Autopilot
from bridge.model.vehicle import Source
from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.msp.command_line import HAZARDS, RUN_LENGTH
from protocols.msp.frame import MspParser

#: Two lost heartbeats.
_SILENCE_S = 2.5
#: An armed Harakiri sends its attitude 30 times a second: when that ends, it has disarmed and changed its speed.
_HARAKIRI_ARMED_SILENCE_S = 0.8
#: Its stream of 1600 bytes a second overruns its own send ring on a slow line, so most frames are torn: before it
#: counts as lost, this many bytes may pass without a whole one. At 2400 baud whole ones come up to 3.5 s apart. At 1200
#: baud there is one in 40 s: no deadline would help.
_BYTES_BEFORE_LOSS = 1000
#: Harakiri is probed for MSP, which it answers again once it is disarmed.
_PROBE_INTERVAL_S = 1.0
#: An incomplete frame is dropped after this long without a byte.
_LINE_SILENCE_S = 0.1
#: The ids of an ordinary ground station; Harakiri answers any sender.
_SYSID, _COMPID = 255, 190
_RUNS = tuple(bytes((hazard,)) * RUN_LENGTH for hazard in sorted(HAZARDS))


class Mavlink(State):
    """The flight controller speaks MAVLink: an armed Harakiri, or an autopilot that represents itself.

    The bridge itself sends only to a Harakiri; other autopilots get nothing but the frames of ground stations.
    """

    name = "MAVLink"
    controller: FlightController

    def __init__(self, port: Port, event: Found, now: float) -> None:
        super().__init__(port, event, now)
        assert event.heard is not None
        profile = self._profile(event.heard)
        self.controller = FlightController(profile, profile.name)
        self._is_harakiri = not profile.is_passed_through
        if port.telemetry is None or self._is_harakiri or profile.family != port.family:
            port.telemetry = MavlinkTelemetry(port.vehicle, is_harakiri=self._is_harakiri)
        self.telemetry = port.telemetry
        port.meet(self.controller)
        self._splitter, self._msp, self._sender = MavlinkSplitter(), MspParser(), _HarakiriSender()
        self._heard_at = self._last_byte_at = now
        self._look_at = now + _LINE_SILENCE_S
        self._probe_due = now + _PROBE_INTERVAL_S if self._is_harakiri else inf
        if self._is_harakiri:
            port.runner.mavlink_up(self._send)
            if event.heard.msgid != messages.MAVLINK_MSG_ID_HEARTBEAT:
                # Unasked, it sends more than heartbeats only while armed.
                port.hear_armed(Source.MAVLINK, now)
        self.telemetry.take([event.heard], now)

    @property
    def bad_checksums(self) -> int | None:
        return self._splitter.bad_frames

    def receive(self, data: bytes, now: float) -> Event | None:
        if self._is_harakiri and self._msp.feed(data):
            return Lost("it answers MSP again", (self.speed,))
        self._last_byte_at = now
        self._take(self._splitter.feed(data), now)
        return None

    def tick(self, now: float) -> Event | None:
        """Ask a Harakiri for MSP now and then, but not during a conversation; notice silence."""
        if self._splitter.is_waiting and now >= self._last_byte_at + _LINE_SILENCE_S:
            # Frames may be hidden behind a false header.
            self._take(self._splitter.reset(), now)
        # Checked ten times a second rather than after each byte: a timer per byte would cost more than the frames.
        self._look_at = now + _LINE_SILENCE_S
        if now >= self._heard_at + self._timeout_s:
            return Lost(f"no MAVLink for {self._timeout_s:.1f} s")
        if now >= self._probe_due:
            self._probe_due = now + _PROBE_INTERVAL_S
            if not self.port.runner.is_busy:
                self.port.output.append(PROBE)
        return None

    def deadline(self) -> float:
        deadline = min(self._heard_at + self._timeout_s, self._probe_due)
        return min(deadline, self._look_at) if self._splitter.is_waiting else deadline

    def _take(self, frames: list[MavlinkFrame], now: float) -> None:
        if not frames:
            return
        self._heard_at = now
        was_armed = self._is_harakiri and self.port.vehicle.armed
        self.telemetry.take(frames, now)
        if was_armed and not self.port.vehicle.armed:
            self._probe_due = now
        self.port.on_mavlink(frames)
        if self.port.runner.is_busy:
            for frame in frames:
                self.port.runner.received_mavlink(frame, now)

    def _send(self, packed: Packed) -> bool:
        """Send a message; False if none of its frames would be free of hazard bytes."""
        frame = self._sender.frame(packed)
        if frame is None:
            return False
        self.port.output.append(frame)
        return True

    @property
    def _timeout_s(self) -> float:
        if not (self._is_harakiri and self.port.vehicle.armed):
            return _SILENCE_S
        return _HARAKIRI_ARMED_SILENCE_S + _BYTES_BEFORE_LOSS * byte_time_s(self.speed)

    def _profile(self, heard: MavlinkFrame) -> Profile:
        """A board met over MSP stays in its family unless it sends MAVLink 2; otherwise the sender decides."""
        (other,) = (profile for profile in self.port.profiles if profile.is_passed_through)
        ours = [p for p in self.port.profiles if p.spoken is Spoken.MAVLINK and p is not other]
        if self.port.autopilot is Autopilot.OTHER:
            return other
        if self.port.autopilot is Autopilot.HARAKIRI:
            return ours[0]
        sender = (heard.version, heard.sysid, heard.compid)
        family = self.port.met_family if heard.version == 1 else None
        known = (p for p in ours if p.family == family or p.mavlink_sender == sender)
        return next(known, other)


class _HarakiriSender:
    """Makes frames without three equal hazard bytes in a row, also across the boundary to the previous frame.

    Three 0x0D enter the CLI in any protocol; '#' and 'R' count only in AUTOSENSE, but it can fall back to that at any
    moment. Unlike our MSP extension, MAVLink has no mask: only the sequence number can be chosen, which also changes
    the CRC. A run within the payload cannot be avoided.
    """

    def __init__(self) -> None:
        self._writer = FrameWriter(_SYSID, _COMPID)
        self._tail = b""

    def frame(self, packed: Packed) -> bytes | None:
        """Return a frame that is safe to send now; None if there is none."""
        for _ in range(256):
            frame = self._writer.frame(packed, 1)
            on_wire = self._tail + frame
            if not any(run in on_wire for run in _RUNS):
                self._tail = on_wire[1 - RUN_LENGTH :]
                return frame
        return None
