# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings that MSP can read in parts, with their names.

Layouts: Harakiri's serial.c; MultiWii's Protocol.cpp; baseflight's serial.c; Cleanflight's and Betaflight's msp.c;
INAV's fc_msp.c.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from protocols.msp.commands import Msp
from protocols.rights.msp import Firmware


class Part(Enum):
    """A part of the settings."""

    PIDS = "PIDs"
    #: A bit for each position of an aux channel, or ranges (protocols.msp.mode_ranges).
    BOXES = "boxes"
    RANGES = "mode ranges"
    RATES = "rates"
    MISC = "MISC"


#: (name, bytes) from the first byte on; "": it lacks a name, or the board itself counts it.
Layout = Sequence[tuple[str, int]]


@dataclass(frozen=True, slots=True)
class SettingsRequest:
    """A request for a part. `layout`: of rates and MISC.

    setter: the command that takes the same payload, but of mode ranges one at a time, behind its number.
    """

    part: Part
    command: int
    setter: int
    layout: Layout = ()


class Field(NamedTuple):
    """One setting in a part's payload: an unsigned number of `size` bytes from `at` on."""

    name: str
    at: int
    size: int

    def value(self, payload: bytes) -> int:
        return int.from_bytes(payload[self.at : self.at + self.size], "little")

    def put(self, payload: bytes, value: int) -> bytes:
        """The payload with another value. OverflowError for one that does not fit."""
        return payload[: self.at] + value.to_bytes(self.size, "little") + payload[self.at + self.size :]


_OLD_RATES: Layout = (
    ("RC rate", 1), ("RC expo", 1), ("roll/pitch rate", 1), ("yaw rate", 1), ("throttle PID", 1), ("throttle mid", 1),
    ("throttle expo", 1),
)  # fmt: skip
_NEW_RATES: Layout = (
    ("RC rate", 1), ("RC expo", 1), ("roll rate", 1), ("pitch rate", 1), ("yaw rate", 1), ("throttle PID", 1),
    ("throttle mid", 1), ("throttle expo", 1), ("TPA breakpoint", 2), ("yaw expo", 1), ("yaw RC rate", 1),
    ("pitch RC rate", 1), ("pitch RC expo", 1), ("throttle limit type", 1), ("throttle limit", 1), ("roll limit", 2),
    ("pitch limit", 2), ("yaw limit", 2), ("rates type", 1), ("throttle hover", 1),
)  # fmt: skip
_THROTTLES: Layout = (("min throttle", 2), ("max throttle", 2), ("min command", 2), ("failsafe throttle", 2))
#: plog.arm and plog.lifetime grow with each flight.
_MULTIWII_MISC: Layout = (
    ("power trigger", 2), *_THROTTLES, ("", 6), ("declination", 2), ("battery scale", 1), ("battery warning 1", 1),
    ("battery warning 2", 1), ("battery critical", 1),
)  # fmt: skip
_NEW_MISC: Layout = (
    ("middle", 2), *_THROTTLES, ("GPS type", 1), ("GPS speed", 1), ("SBAS", 1), ("current output", 1),
    ("RSSI channel", 1), ("", 1), ("declination", 2), ("battery scale", 1), ("cell min", 1), ("cell max", 1),
    ("cell warning", 1),
)  # fmt: skip
_PIDS = SettingsRequest(Part.PIDS, Msp.PID, 202)
#: In newer firmware 113 has the active boxes, which change in flight.
BOXES, RANGES = SettingsRequest(Part.BOXES, Msp.BOX, 203), SettingsRequest(Part.RANGES, Msp.MODE_RANGES, 35)
_RATES_7, _RATES = (SettingsRequest(Part.RATES, Msp.RC_TUNING, 204, layout) for layout in (_OLD_RATES, _NEW_RATES))
_MISC = SettingsRequest(Part.MISC, Msp.MISC, 207)
_MISC_22 = SettingsRequest(Part.MISC, Msp.MISC, 207, _NEW_MISC)
_NEW = (_PIDS, RANGES, _RATES, _MISC_22)
SETTINGS: Mapping[Firmware, tuple[SettingsRequest, ...]] = {
    Firmware.HARAKIRI: (_PIDS, BOXES, _RATES_7, _MISC),
    Firmware.HARAKIRI_MISSIONS: (_PIDS, BOXES, _RATES_7, _MISC),
    Firmware.BASEFLIGHT: (_PIDS, BOXES, _RATES_7, _MISC_22),
    Firmware.MULTIWII: (_PIDS, BOXES, _RATES_7, SettingsRequest(Part.MISC, Msp.MISC, 207, _MULTIWII_MISC)),
    Firmware.CLEANFLIGHT: _NEW,
    Firmware.BETAFLIGHT: _NEW,
    Firmware.INAV: (RANGES,),
    # MISC may have counters, and the rates any layout.
    Firmware.UNKNOWN: (_PIDS, SettingsRequest(Part.RATES, Msp.RC_TUNING, 204)),
}
_PID_SIZE = 3


def fields(request: SettingsRequest, payload: bytes, pids: Sequence[str], boxes: Sequence[str]) -> tuple[Field, ...]:
    """The settings in a reply, each with a unique name. Bytes without a name are left out. None of mode ranges.

    pids, boxes: the flight controller's names, in the order of PID and BOX.
    """
    found: list[Field] = []
    match request.part:
        case Part.PIDS:
            found = [
                Field(f"{name} {letter}", number * _PID_SIZE + at, 1)
                for number, name in enumerate(pids[: len(payload) // _PID_SIZE])
                for at, letter in enumerate("PID")
            ]
        case Part.BOXES:
            size = len(payload) // len(boxes) if boxes else 0
            found = [Field(f"BOX {name}", at * size, size) for at, name in enumerate(boxes if size else ()) if name]
        case Part.RATES | Part.MISC:
            at = 0
            for label, size in request.layout:
                if label and at + size <= len(payload):
                    found.append(Field(label, at, size))
                at += size
    return tuple(found)
