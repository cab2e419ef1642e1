# SPDX-License-Identifier: GPL-3.0-or-later
"""A port on which MAVLink is spoken: what comes in, and when it is over. Sans-IO."""

from bridge.line.mavlink_sender import HarakiriSender
from bridge.line.msp_link import PROBE
from protocols.mavlink.codec import Packed
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mavlink.heartbeat import is_plausible_heartbeat
from protocols.msp.frame import MspParser

#: Other autopilots are given the time of two lost heartbeats.
_SILENCE_S = 2.5
#: An armed Harakiri sends its attitude 30 times a second: when that ends, it has disarmed and changed its speed.
_HARAKIRI_ARMED_SILENCE_S = 0.8
#: Harakiri is asked for MSP now and then: it answers again once it is disarmed.
_PROBE_INTERVAL_S = 1.0
#: After so long without a byte nothing more comes of a frame that has begun.
_LINE_SILENCE_S = 0.1
#: A heartbeat's base_mode: where it is, and its bit for "armed".
_BASE_MODE, _SAFETY_ARMED = 6, 0x80


class MavlinkLine:
    """Feed bytes and time until `ended` says why it is over."""

    def __init__(self, *, is_harakiri: bool, now: float) -> None:
        self._is_harakiri = is_harakiri
        self._splitter = MavlinkSplitter()
        self._msp = MspParser()
        self._heard_at = self._last_byte_at = now
        self._look_at = now + _LINE_SILENCE_S
        self._probe_due = now + _PROBE_INTERVAL_S
        self._sender = HarakiriSender()
        self._output: list[bytes] = []
        self.armed: bool | None = None
        self.ended: str | None = None

    @property
    def bad_frames(self) -> int:
        """Frames whose checksum was wrong."""
        return self._splitter.bad_frames

    def receive(self, data: bytes, now: float) -> list[MavlinkFrame]:
        """Take bytes from the port; return the whole frames."""
        self._last_byte_at = now
        frames = self._splitter.feed(data)
        self._note(frames, now)
        if self._is_harakiri and self._msp.feed(data):
            self.ended = "it answers MSP again"
        return frames

    def _note(self, frames: list[MavlinkFrame], now: float) -> None:
        if frames:
            self._heard_at = now
        for frame in frames:
            if frame.msgid == 0 and is_plausible_heartbeat(frame):
                armed = bool(frame.payload[_BASE_MODE] & _SAFETY_ARMED)
                if self.armed and not armed:
                    self._probe_due = now
                self.armed = armed

    def send(self, packed: Packed) -> bool:
        """Send a message to a Harakiri; False if there is no safe way to."""
        frame = self._sender.frame(packed)
        if frame is None:
            return False
        self._output.append(frame)
        return True

    def take_output(self) -> list[bytes]:
        """Return what is to be written. To other autopilots goes nothing but what ground stations send."""
        output, self._output = self._output, []
        return output

    def tick(self, now: float, *, is_conversing: bool) -> list[MavlinkFrame]:
        """Ask for MSP when that is due, but not amidst a conversation; notice silence.

        Return frames that a false header was hiding: it is believed no longer once the line is quiet.
        """
        frames: list[MavlinkFrame] = []
        if self._splitter.is_waiting and now >= self._last_byte_at + _LINE_SILENCE_S:
            frames = self._splitter.reset()
            self._note(frames, now)
        # Looked at ten times a second rather than after each byte: a timer for each would cost more than the frames.
        self._look_at = now + _LINE_SILENCE_S
        if now >= self._silent_at:
            self.ended = f"no MAVLink for {self._patience_s} s"
        elif self._is_harakiri and now >= self._probe_due:
            self._probe_due = now + _PROBE_INTERVAL_S
            if not is_conversing:
                self._output.append(PROBE)
        return frames

    def next_deadline(self) -> float:
        """Return when `tick` has something to do."""
        deadline = min(self._silent_at, self._probe_due) if self._is_harakiri else self._silent_at
        return min(deadline, self._look_at) if self._splitter.is_waiting else deadline

    @property
    def _patience_s(self) -> float:
        return _HARAKIRI_ARMED_SILENCE_S if self._is_harakiri and self.armed else _SILENCE_S

    @property
    def _silent_at(self) -> float:
        return self._heard_at + self._patience_s
