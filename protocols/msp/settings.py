# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings that MSP can read in parts, and the names of those in which two replies differ.

Layouts: Harakiri's serial.c; MultiWii's Protocol.cpp; baseflight's serial.c; Cleanflight's and Betaflight's msp.c;
INAV's fc_msp.c.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from protocols.msp.commands import Msp
from protocols.msp.setting_table import TABLE_BODY, SettingCommand
from protocols.rights.msp import Firmware


class Part(Enum):
    """A part of the settings, as named to the pilot."""

    PIDS = "PIDs"
    MODES = "modes"
    RATES = "rates"
    MISC = "MISC"
    #: Known by a checksum over all settings, those of other parts included.
    OTHERS = "other settings"


#: (name, bytes) from the first byte on; "": it has no name. None: the board itself counts it, and it is not a setting.
Layout = Sequence[tuple[str | None, int]]


@dataclass(frozen=True, slots=True)
class SettingsRequest:
    """A request for a part. `pid_size`: bytes for each PID; `layout`: of rates and MISC.

    setter: the command that takes the same payload, but of mode ranges one at a time, behind its number.
    instead: a command that takes its place if the first byte of its reply is set. body: the request's payload. begins:
    the first bytes of a reply with settings.
    """

    part: Part
    command: int
    setter: int
    layout: Layout = ()
    pid_size: int = 3
    instead: int | None = None
    body: bytes = b""
    begins: bytes = b""

    def settings(self, payload: bytes) -> bytes:
        """The payload with its counters as zeros."""
        kept, at = bytearray(payload), 0
        for name, size in self.layout:
            if name is None:
                kept[at : at + size] = bytes(len(kept[at : at + size]))
            at += size
        return bytes(kept)


class Field(NamedTuple):
    """One setting in a part's payload: an unsigned number of `size` bytes from `at` on. group: for the pilot."""

    name: str
    group: str
    at: int
    size: int

    def value(self, payload: bytes) -> int:
        return int.from_bytes(payload[self.at : self.at + self.size], "little")

    def put(self, payload: bytes, value: int) -> bytes:
        """The payload with another value. OverflowError for one that does not fit."""
        return payload[: self.at] + value.to_bytes(self.size, "little") + payload[self.at + self.size :]


@dataclass(frozen=True, slots=True)
class SettingNames:
    """The flight controller's names: of the PIDs, of the boxes in the order of BOX, and by their permanent ids."""

    pids: Sequence[str] = ()
    boxes: Sequence[str] = ()
    boxes_by_id: Mapping[int, str] | None = None


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
_INAV_RATES: Layout = (
    ("throttle mid", 1), ("throttle expo", 1), ("throttle PID", 1), ("TPA breakpoint", 2), ("RC expo", 1),
    ("yaw expo", 1), ("roll rate", 1), ("pitch rate", 1), ("yaw rate", 1), ("manual expo", 1), ("manual yaw expo", 1),
    ("manual roll rate", 1), ("manual pitch rate", 1), ("manual yaw rate", 1),
)  # fmt: skip
_THROTTLES: Layout = (("min throttle", 2), ("max throttle", 2), ("min command", 2), ("failsafe throttle", 2))
#: plog.arm and plog.lifetime grow with each flight.
_MULTIWII_MISC: Layout = (
    ("power trigger", 2), *_THROTTLES, (None, 6), ("declination", 2), ("battery scale", 1), ("battery warning 1", 1),
    ("battery warning 2", 1), ("battery critical", 1),
)  # fmt: skip
_NEW_MISC: Layout = (
    ("middle", 2), *_THROTTLES, ("GPS type", 1), ("GPS speed", 1), ("SBAS", 1), ("current output", 1),
    ("RSSI channel", 1), ("", 1), ("declination", 2), ("battery scale", 1), ("cell min", 1), ("cell max", 1),
    ("cell warning", 1),
)  # fmt: skip
_INAV_MISC: Layout = (
    ("middle", 2), *_THROTTLES, ("GPS type", 1), ("GPS speed", 1), ("SBAS", 1), ("RSSI channel", 1),
    ("declination", 2), ("battery scale", 2), ("battery source", 1), ("cells", 1), ("cell detect", 2), ("cell min", 2),
    ("cell max", 2), ("cell warning", 2), ("capacity", 4), ("capacity warning", 4), ("capacity critical", 4),
    ("capacity unit", 1),
)  # fmt: skip
_PIDS = SettingsRequest(Part.PIDS, Msp.PID, 202)
#: In newer firmware 113 has the active boxes, which change in flight.
BOXES, RANGES = SettingsRequest(Part.MODES, Msp.BOX, 203), SettingsRequest(Part.MODES, Msp.MODE_RANGES, 35)
_RATES_7, _RATES = (SettingsRequest(Part.RATES, Msp.RC_TUNING, 204, layout) for layout in (_OLD_RATES, _NEW_RATES))
_MISC = SettingsRequest(Part.MISC, Msp.MISC, 207)
_MISC_22 = SettingsRequest(Part.MISC, Msp.MISC, 207, _NEW_MISC)
_OTHERS = SettingsRequest(
    Part.OTHERS, SettingCommand.SETTING, SettingCommand.SET_SETTING, body=TABLE_BODY, begins=b"\0\xff\xff"
)
_NEW = (_PIDS, RANGES, _RATES, _MISC_22)
SETTINGS: Mapping[Firmware, tuple[SettingsRequest, ...]] = {
    Firmware.HARAKIRI: (_PIDS, BOXES, _RATES_7, _MISC),
    Firmware.HARAKIRI_MISSIONS: (_PIDS, BOXES, _RATES_7, _MISC, _OTHERS),
    Firmware.BASEFLIGHT: (_PIDS, BOXES, _RATES_7, _MISC_22),
    Firmware.MULTIWII: (_PIDS, BOXES, _RATES_7, SettingsRequest(Part.MISC, Msp.MISC, 207, _MULTIWII_MISC)),
    Firmware.CLEANFLIGHT: _NEW,
    Firmware.BETAFLIGHT: _NEW,
    Firmware.INAV: (
        # With EZ Tune on, each reading of the PIDs lets INAV compute them from EZ Tune's own values again.
        SettingsRequest(Part.PIDS, Msp.PID_V2, 0x2031, pid_size=4, instead=Msp.INAV_EZ_TUNE),
        RANGES,
        SettingsRequest(Part.RATES, Msp.INAV_RATE_PROFILE, 0x2008, _INAV_RATES),
        SettingsRequest(Part.MISC, Msp.INAV_MISC, 0x2004, _INAV_MISC),
    ),
    # Its MISC may have counters, and its rates any layout.
    Firmware.UNKNOWN: (_PIDS, RANGES, SettingsRequest(Part.RATES, Msp.RC_TUNING, 204)),
}
RANGE_SIZE = 4


def fields(request: SettingsRequest, payload: bytes, names: SettingNames) -> tuple[Field, ...]:
    """The settings in a reply, each with a unique name; bytes without a name are left out."""
    match request.part:
        case Part.PIDS:
            size, letters = request.pid_size, "PIDF"
            found = [
                Field(f"{name} {letters[at]}", name, number * size + at, 1)
                for number, name in enumerate(names.pids[: len(payload) // size])
                for at in range(size)
            ]
        case Part.MODES if request.command == Msp.MODE_RANGES:
            parts = ("ID", "AUX", "LOW", "HIGH")
            found = [
                Field(f"MODE{at // RANGE_SIZE + 1} {parts[at % RANGE_SIZE]}", "", at, 1)
                for at in range(len(payload) // RANGE_SIZE * RANGE_SIZE)
            ]
        case Part.MODES:
            size = len(payload) // len(names.boxes) if names.boxes else 0
            found = [
                Field(f"BOX {name}", name, at * size, size)
                for at, name in enumerate(names.boxes if size else ())
                if name
            ]
        case Part.RATES | Part.MISC:
            found, at = [], 0
            for label, size in request.layout:
                if label and at + size <= len(payload):
                    found.append(Field(label, label, at, size))
                at += size
        case Part.OTHERS:
            found = []
    return tuple(found)


def changed_names(request: SettingsRequest, before: bytes, after: bytes, names: SettingNames) -> tuple[str, ...]:
    """The names of the settings in which two replies differ; none if only their sizes do, or no name is known."""
    if len(before) != len(after):
        return ()
    if request.command == Msp.MODE_RANGES:
        found = _changed_ranges(before, after, names.boxes_by_id or {})
    else:
        held = fields(request, after, names)
        found = (field.group for field in held if field.value(before) != field.value(after))
    return tuple(dict.fromkeys(name for name in found if name))


def _changed_ranges(before: bytes, after: bytes, names: Mapping[int, str]) -> Iterator[str]:
    """MODE_RANGES: permanent id, aux channel, first and last step of each range; it may be at any place."""
    first, second = (_ranges(payload) for payload in (before, after))
    for number in sorted(first.keys() | second.keys()):
        if first.get(number) != second.get(number):
            yield names.get(number, f"mode {number}")


def _ranges(payload: bytes) -> Mapping[int, list[bytes]]:
    found: dict[int, list[bytes]] = {}
    for at in range(0, len(payload) - RANGE_SIZE + 1, RANGE_SIZE):
        number, channel, first, last = payload[at : at + RANGE_SIZE]
        if first < last:  # else it is unused
            found.setdefault(number, []).append(bytes((channel, first, last)))
    return {number: sorted(ranges) for number, ranges in found.items()}
