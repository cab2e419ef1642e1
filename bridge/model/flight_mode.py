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


#: An aux channel's positions (MultiWii, and all its relatives).
_LOW_BELOW_US, _HIGH_ABOVE_US = 1300, 1700

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


def active_boxes(activation: Sequence[int], aux_us: Sequence[int]) -> int:
    """The boxes that the pilot's switches turn on, one bit each: what MSP_BOX and the aux channels say together.

    `activation` has one word a box, three bits an aux channel: low, middle, high.
    """
    positions = 0
    for number, width_us in enumerate(aux_us):
        position = (width_us > _LOW_BELOW_US) + (width_us > _HIGH_ABOVE_US)
        positions |= 1 << 3 * number + position
    return sum(1 << box for box, wanted in enumerate(activation) if wanted & positions)
