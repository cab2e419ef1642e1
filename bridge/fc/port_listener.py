# SPDX-License-Identifier: GPL-3.0-or-later
"""Listens to a serial port before anything is sent, to detect GPS receivers and telemetry radios. Sans-IO.

A GPS receiver sends at least once a second. A SiK radio puts its own RADIO_STATUS (system 51, component 68) between
the frames of the other end, which is a ground station. Only complete frames count. A device that stays silent, or is
not understood at any speed, may be a flight controller and is left to autosense.
"""

import re
from functools import reduce
from itertools import accumulate
from operator import xor

from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter

#: The first one is that of most flight controllers. The others are tried only if something is heard.
LISTENING_SPEEDS = (115200, 9600, 57600, 38400, 230400, 19200, 4800)
#: GPS receivers and heartbeats come once a second.
_LISTEN_S = 1.2
#: Shorter noise comes from plugging in.
_NOISE_SIZE = 8
_HEARTBEAT, _RADIO_STATUS = 0, 109
_GROUND_STATION = 6  # MAV_TYPE_GCS
_SIK_SENDER = (51, 68)


class PortListener:
    """One port. Set it to `speed`, feed bytes and time until `is_done`. `what` is empty if it may be probed."""

    def __init__(self, now: float) -> None:
        self._speeds = iter(LISTENING_SPEEDS)
        self.speed = next(self._speeds)
        self.is_done = False
        #: The device, once it has shown that it is not a flight controller.
        self.what = ""
        self._begin(now)

    def _begin(self, now: float) -> None:
        self._gps = GpsWatch()
        self._mavlink = MavlinkSplitter()
        self._hears_vehicle = False
        self._size = 0
        self.ends = now + _LISTEN_S

    def receive(self, data: bytes) -> None:
        self._size += len(data)
        self._gps.feed(data)
        if self._gps.heard:
            self.what = f"a GPS receiver ({self._gps.heard})"
        for frame in self._mavlink.feed(data):
            self._mavlink_frame(frame)
        # A SiK radio also passes on the heartbeats of a vehicle at its other end: so the whole time is used.
        self.is_done = bool(self.what)

    def _mavlink_frame(self, frame: MavlinkFrame) -> None:
        if frame.msgid == _RADIO_STATUS and (frame.sysid, frame.compid) == _SIK_SENDER:
            self.what = "a SiK telemetry radio"
        elif frame.msgid == _HEARTBEAT and frame.payload[4:5] == bytes((_GROUND_STATION,)):
            self.what = "a telemetry radio with a ground station at its other end"
        elif frame.msgid == _HEARTBEAT:
            self._hears_vehicle = True

    def tick(self, now: float) -> None:
        """Move on to the next speed, or end."""
        if self.is_done or now < self.ends:
            return
        speed = None if self._size < _NOISE_SIZE or self._hears_vehicle else next(self._speeds, None)
        if speed is None:
            self.is_done = True
        else:
            self.speed = speed
            self._begin(now)


_NMEA = re.compile(rb"\$((?:G[A-Z]|BD|P)[A-Z]{3},[ -)+-~]{0,90})\*([0-9A-F]{2})")
_UBX_SYNC = b"\xb5\x62"
_UBX_FRAME = 8
_UBX_LONGEST = 1024
#: At least an NMEA sentence.
_LONGEST_SENTENCE = 110


class GpsWatch:
    """Feed bytes. `heard` names the protocol after a complete sentence or frame with a valid checksum."""

    def __init__(self) -> None:
        self.heard = ""
        self._text = self._frame = b""

    def feed(self, data: bytes) -> None:
        if self.heard:
            return
        text = self._text + data
        self._text = text[text.rfind(b"$") :][-_LONGEST_SENTENCE:]
        if any(reduce(xor, body) == int(checksum, 16) for body, checksum in _NMEA.findall(text)):
            self.heard = "NMEA"
        elif self._has_ubx(self._frame + data):
            self.heard = "UBX"

    def _has_ubx(self, data: bytes) -> bool:
        """Try each frame once, when it is complete."""
        start = data.find(_UBX_SYNC)
        while start >= 0:
            end = start + _UBX_FRAME + int.from_bytes(data[start + 4 : start + 6], "little")
            if end <= start + _UBX_FRAME + _UBX_LONGEST:
                if end > len(data):
                    break
                if _fletcher(data[start + 2 : end - 2]) == data[end - 2 : end]:
                    return True
            start = data.find(_UBX_SYNC, start + 1)
        # The next sync's first byte may be the last.
        self._frame = data[start:]
        return False


def _fletcher(data: bytes) -> bytes:
    return bytes((sum(data) & 0xFF, sum(accumulate(data)) & 0xFF))
