# SPDX-License-Identifier: GPL-3.0-or-later
"""The craft as plain data: the kind, the flight mode, the battery, and the memory of a flight."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from enum import Enum, IntEnum, auto
from itertools import pairwise
from math import ceil


class Airframe(IntEnum):
    """MAVLink's MAV_TYPE."""

    FIXED_WING = 1
    QUADROTOR = 2
    HELICOPTER = 4
    ROVER = 10
    BOAT = 11
    HEXAROTOR = 13
    OCTOROTOR = 14
    TRICOPTER = 15


_MIXERS: Mapping[int, Airframe] = {
    1: Airframe.TRICOPTER,
    6: Airframe.HEXAROTOR,
    7: Airframe.HEXAROTOR,
    8: Airframe.FIXED_WING,
    10: Airframe.HEXAROTOR,
    11: Airframe.OCTOROTOR,
    12: Airframe.OCTOROTOR,
    13: Airframe.OCTOROTOR,
    14: Airframe.FIXED_WING,
    15: Airframe.HELICOPTER,
    16: Airframe.HELICOPTER,
    18: Airframe.HEXAROTOR,
}


def airframe(mixer: int) -> Airframe:
    """By MultiWii's MULTITYPE (Harakiri: mw.h). Others are shown as a quadrocopter."""
    return _MIXERS.get(mixer, Airframe.QUADROTOR)


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

#: The thresholds of an aux channel's positions (MultiWii and descendants).
_LOW_BELOW_US, _HIGH_ABOVE_US = 1300, 1700

#: The boxes that fly the mission: Harakiri's, MultiWii NAV's and INAV's. Harakiri's is only the pilot's switch: a board
#: that flies the mission reports that (MissionLeg).
MISSION_BOXES = frozenset({"GPS AUTO", "MISSION", "NAV WP"})
#: The first mode with an active box wins. Harakiri's, baseflight's and Cleanflight's names, then those of MultiWii NAV,
#: INAV and Betaflight.
_BOXES: tuple[tuple[FlightMode, frozenset[str]], ...] = (
    (FlightMode.MANUAL, frozenset({"MANUAL"})),
    (FlightMode.LAUNCH, frozenset({"NAV LAUNCH"})),
    (FlightMode.AUTO, MISSION_BOXES - {"GPS AUTO"}),
    (FlightMode.RTL, frozenset({"GPS HOME", "NAV RTH", "GPS RESCUE"})),
    (FlightMode.LOITER, frozenset({"GPS HOLD", "NAV POSHOLD", "POS HOLD"})),
    (FlightMode.CRUISE, frozenset({"NAV COURSE HOLD", "NAV CRUISE"})),
    (FlightMode.ALT_HOLD, frozenset({"BARO", "NAV ALTHOLD", "ALT HOLD"})),
    (FlightMode.STABILIZE, frozenset({"ANGLE"})),
    (FlightMode.HORIZON, frozenset({"HORIZON", "ANGLE HOLD"})),
)


def names_of_active(box_flags: int, boxes: Sequence[str]) -> set[str]:
    """The active boxes. `box_flags` has one bit for each of `boxes`, in their order."""
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


#: Less than any usable LiPo: the board has power from elsewhere, such as USB.
LEAST_V = 2.5
#: The highest voltage of a charged cell.
_FULL_CELL_V = 4.25
#: Volts per cell at rest -> percent remaining.
_CURVE = ((3.3, 0), (3.5, 5), (3.7, 20), (3.8, 45), (3.9, 65), (4.0, 80), (4.2, 100))


def least_cells(voltage_v: float) -> int:
    """The fewest cells that can have this voltage; right for a battery that was plugged in charged."""
    return ceil(voltage_v / _FULL_CELL_V)


def remaining_percent(voltage_v: float, cells: int) -> int:
    """The remaining charge, 0..100."""
    cell_v = voltage_v / cells
    for (low_v, low), (high_v, high) in pairwise(_CURVE):
        if cell_v < high_v:
            return round(max(low + (high - low) * (cell_v - low_v) / (high_v - low_v), 0))
    return 100


@dataclass(frozen=True, slots=True)
class Home:
    """Degrees * 1e7. altitude_m above mean sea level."""

    lat_e7: int
    lon_e7: int
    altitude_m: float | None = None


@dataclass(frozen=True, slots=True)
class FlightMemory:
    """An armed craft: what a bridge restarted in flight needs, because an armed flight controller may not report it.

    A Harakiri that speaks MAVLink does not report home and the switch ranges that make its flight mode. Times are
    monotonic seconds, valid until the computer restarts.

    family: of the flight controller, as in Profile. armed_at: when it was armed, or first heard armed. mode: when the
    memory was made. boxes, activation: as in Switches. cells: of the battery.
    """

    family: str
    armed_at: float
    made_at: float
    mode: FlightMode | None
    home: Home | None
    boxes: tuple[str, ...]
    activation: tuple[int, ...]
    airframe: Airframe
    version: tuple[int, int, int] | None
    cells: int
