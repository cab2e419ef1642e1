# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight mode that follows from the active boxes, as an ArduPilot mode, which ground stations can name."""

from collections.abc import Sequence, Set
from enum import Enum, auto


class FlightMode(Enum):
    """The flight mode selected by the pilot's switches."""

    ACRO = auto()
    #: The sticks move the servos.
    MANUAL = auto()
    #: The sticks are angles.
    STABILIZE = auto()
    #: Level with released sticks.
    HORIZON = auto()
    ALT_HOLD = auto()
    LOITER = auto()
    #: The course over ground is held, and mostly the altitude.
    CRUISE = auto()
    #: An aeroplane thrown by hand or from a catapult.
    LAUNCH = auto()
    RTL = auto()
    AUTO = auto()


#: The flag of an armed craft, on every descendant of MultiWii.
ARM_BOX = "ARM"
#: A flag of INAV and Betaflight: the receiver is silent, or the pilot's switch is on, and the failsafe procedure runs.
FAILSAFE_BOX = "FAILSAFE"

#: The thresholds of an aux channel's positions (MultiWii and its descendants).
_LOW_BELOW_US, _HIGH_ABOVE_US = 1300, 1700

#: The boxes that fly the mission: Harakiri's, MultiWii NAV's and INAV's.
MISSION_BOXES = frozenset({"GPS AUTO", "MISSION", "NAV WP"})
#: The first mode with an active box wins. Harakiri's, baseflight's and Cleanflight's names, then those of MultiWii NAV,
#: INAV and Betaflight.
_BOXES: tuple[tuple[FlightMode, frozenset[str]], ...] = (
    (FlightMode.MANUAL, frozenset({"MANUAL"})),
    (FlightMode.LAUNCH, frozenset({"NAV LAUNCH"})),
    (FlightMode.AUTO, MISSION_BOXES),
    (FlightMode.RTL, frozenset({"GPS HOME", "NAV RTH", "GPS RESCUE"})),
    (FlightMode.LOITER, frozenset({"GPS HOLD", "NAV POSHOLD", "POS HOLD"})),
    (FlightMode.CRUISE, frozenset({"NAV COURSE HOLD", "NAV CRUISE"})),
    (FlightMode.ALT_HOLD, frozenset({"BARO", "NAV ALTHOLD", "ALT HOLD"})),
    (FlightMode.STABILIZE, frozenset({"ANGLE"})),
    (FlightMode.HORIZON, frozenset({"HORIZON", "ANGLE HOLD"})),
)


def names_of_active(box_flags: int, boxes: Sequence[str]) -> set[str]:
    """The active boxes; `box_flags` has one bit for each of `boxes`, in their order."""
    return {name for bit, name in enumerate(boxes) if box_flags >> bit & 1}


def flight_mode(active: Set[str]) -> FlightMode:
    for mode, names in _BOXES:
        if active & names:
            return mode
    return FlightMode.ACRO


def active_boxes(activation: Sequence[int], aux_us: Sequence[int]) -> int:
    """The boxes that the pilot's switches turn on, one bit each, from MSP_BOX and the aux channels.

    `activation` has one word per box, with three bits per aux channel: low, middle, high.
    """
    positions = 0
    for number, width_us in enumerate(aux_us):
        position = (width_us > _LOW_BELOW_US) + (width_us > _HIGH_ABOVE_US)
        positions |= 1 << 3 * number + position
    return sum(1 << box for box, wanted in enumerate(activation) if wanted & positions)
