# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink frames that are safe to send to a Harakiri. Sans-IO."""

from protocols.mavlink.codec import FrameWriter, Packed
from protocols.msp.command_line import HAZARDS, RUN_LENGTH

#: The ids of an ordinary ground station; Harakiri answers any sender.
_SYSID, _COMPID = 255, 190
_RUNS = tuple(bytes((hazard,)) * RUN_LENGTH for hazard in sorted(HAZARDS))


class HarakiriSender:
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
