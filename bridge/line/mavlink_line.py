# SPDX-License-Identifier: GPL-3.0-or-later
"""A port that carries MAVLink: its frames, and the moment it ends. Sans-IO."""

from bridge.line.msp_link import PROBE
from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mavlink.heartbeat import is_plausible_heartbeat
from protocols.msp.frame import MspParser
from protocols.msp.hazards import HAZARDS, RUN_LENGTH

#: Two lost heartbeats, for autopilots other than Harakiri.
_SILENCE_S = 2.5
#: An armed Harakiri sends its attitude 30 times a second: when that ends, it has disarmed and changed its speed.
_HARAKIRI_ARMED_SILENCE_S = 0.8
#: Harakiri is probed for MSP, which it answers again once it is disarmed.
_PROBE_INTERVAL_S = 1.0
#: After this long without a byte, an incomplete frame is given up.
_LINE_SILENCE_S = 0.1
#: The offset of base_mode in HEARTBEAT, and its armed bit.
_BASE_MODE, _SAFETY_ARMED = 6, 0x80
#: The ids of an ordinary ground station; Harakiri answers any sender.
_SYSID, _COMPID = 255, 190
_RUNS = tuple(bytes((hazard,)) * RUN_LENGTH for hazard in sorted(HAZARDS))


class MavlinkLine:
    """Feed bytes and time; `ended` is set to the reason when MAVLink stops."""

    def __init__(self, *, is_harakiri: bool, now: float) -> None:
        self._is_harakiri = is_harakiri
        self._splitter = MavlinkSplitter()
        self._msp = MspParser()
        self._heard_at = self._last_byte_at = now
        self._look_at = now + _LINE_SILENCE_S
        self._probe_due = now + _PROBE_INTERVAL_S
        self._sender = _HarakiriSender()
        self._output: list[bytes] = []
        self.armed: bool | None = None
        self.ended: str | None = None

    @property
    def bad_frames(self) -> int:
        """Frames with a wrong checksum."""
        return self._splitter.bad_frames

    def receive(self, data: bytes, now: float) -> list[MavlinkFrame]:
        """Take bytes from the port; return the whole frames."""
        self._last_byte_at = now
        frames = self._splitter.feed(data)
        if frames:
            self._note(frames, now)
        if self._is_harakiri and self._msp.feed(data):
            self.ended = "it answers MSP again"
        return frames

    def _note(self, frames: list[MavlinkFrame], now: float) -> None:
        self._heard_at = now
        if not self._is_harakiri:
            return
        for frame in frames:
            if frame.msgid == 0 and is_plausible_heartbeat(frame):
                armed = bool(frame.payload[_BASE_MODE] & _SAFETY_ARMED)
                if self.armed and not armed:
                    self._probe_due = now
                self.armed = armed

    def send(self, packed: Packed) -> bool:
        """Send a message to a Harakiri; False if none of its frames would be free of hazard bytes."""
        frame = self._sender.frame(packed)
        if frame is None:
            return False
        self._output.append(frame)
        return True

    def take_output(self) -> list[bytes]:
        """The bytes to be written. Other autopilots get nothing but the frames of ground stations."""
        output, self._output = self._output, []
        return output

    def tick(self, now: float, *, is_conversing: bool) -> list[MavlinkFrame]:
        """Probe for MSP when due, but not during a conversation; notice silence.

        Returns frames that were hidden behind a false header, which is dropped once the line is quiet.
        """
        frames: list[MavlinkFrame] = []
        if self._splitter.is_waiting and now >= self._last_byte_at + _LINE_SILENCE_S:
            frames = self._splitter.reset()
            if frames:
                self._note(frames, now)
        # Checked ten times a second rather than after each byte: a timer per byte would cost more than the frames.
        self._look_at = now + _LINE_SILENCE_S
        if now >= self._silent_at:
            self.ended = f"no MAVLink for {self._timeout_s} s"
        elif self._is_harakiri and now >= self._probe_due:
            self._probe_due = now + _PROBE_INTERVAL_S
            if not is_conversing:
                self._output.append(PROBE)
        return frames

    def next_deadline(self) -> float:
        """The time of the next `tick`."""
        deadline = min(self._silent_at, self._probe_due) if self._is_harakiri else self._silent_at
        return min(deadline, self._look_at) if self._splitter.is_waiting else deadline

    @property
    def _timeout_s(self) -> float:
        return _HARAKIRI_ARMED_SILENCE_S if self._is_harakiri and self.armed else _SILENCE_S

    @property
    def _silent_at(self) -> float:
        return self._heard_at + self._timeout_s


class _HarakiriSender:
    """Makes frames without three equal hazard bytes in a row, also across the boundary to the previous frame.

    Three 0x0D enter the CLI in any protocol; '#' and 'R' count only in AUTOSENSE, but it can fall back to that at any
    moment. MAVLink has no masking as our MSP extension has: only the sequence number may be chosen, and with it
    changes the CRC. A run within the payload cannot be avoided.
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
