# SPDX-License-Identifier: GPL-3.0-or-later
"""Which flight mode the active boxes make, in ArduCopter's terms: what ground stations can name and colour."""

from collections.abc import Sequence
from enum import Enum, auto


class FlightMode(Enum):
    """What the pilot's switches have chosen."""

    ACRO = auto()
    STABILIZE = auto()
    ALT_HOLD = auto()
    LOITER = auto()
    RTL = auto()
    AUTO = auto()


#: The first whose box is active wins. Harakiri's, baseflight's and Cleanflight's names, then those of MultiWii NAV,
#: INAV and Betaflight.
_BOXES: tuple[tuple[FlightMode, frozenset[str]], ...] = (
    (FlightMode.AUTO, frozenset({"GPS AUTO", "NAV WP", "MISSION"})),
    (FlightMode.RTL, frozenset({"GPS HOME", "NAV RTH", "GPS RESCUE"})),
    (FlightMode.LOITER, frozenset({"GPS HOLD", "NAV POSHOLD", "POS HOLD"})),
    (FlightMode.ALT_HOLD, frozenset({"BARO", "NAV ALTHOLD", "ALT HOLD"})),
    (FlightMode.STABILIZE, frozenset({"ANGLE", "HORIZON"})),
)


def flight_mode(box_flags: int, boxes: Sequence[str]) -> FlightMode:
    """Return the mode; `box_flags` has one bit for each of `boxes`, in their order."""
    active = {name for bit, name in enumerate(boxes) if box_flags >> bit & 1}
    return next((mode for mode, names in _BOXES if active & names), FlightMode.ACRO)
