# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes on an MSP line that are not MSP."""

from bridge.line.msp_link import MspLink
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mavlink.heartbeat import is_disarmed_heartbeat


class ForeignBytes:
    """Bytes on an MSP line that are not MSP, since the last reply."""

    def __init__(self) -> None:
        self.size = 0
        self.mavlink: MavlinkFrame | None = None
        self._skipped_before = 0
        self._splitter = MavlinkSplitter()

    def note(self, data: bytes, link: MspLink, *, is_msp: bool) -> None:
        """Examine received bytes."""
        skipped, self._skipped_before = link.skipped_bytes - self._skipped_before, link.skipped_bytes
        if is_msp:
            if self.size:
                self.size, self.mavlink, self._splitter = 0, None, MavlinkSplitter()
            return
        self.size += skipped
        if skipped:
            for frame in self._splitter.feed(data):
                # A disarmed Harakiri that hears no request sends heartbeats, and still answers MSP.
                if not is_disarmed_heartbeat(frame):
                    self.mavlink = frame
