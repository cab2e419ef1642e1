# SPDX-License-Identifier: GPL-3.0-or-later
"""The mission rules of INAV and MultiWii NAV by command: the table of docs/inav.md."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto

from bridge.controllers.nav.flown_path import BoardLimits
from bridge.missions.list_check import UNUSED, Range
from protocols.mission_item import ROI_COMMANDS, Command
from protocols.msp.nav import ENDLESS_S, NavAction, NavRecord

Mission = tuple[NavRecord, ...]

#: Records.
INAV_CAPACITY = 120
#: The height above home that replaces 0, metres.
LEAST_HEIGHT_M = 2
HOLD = Range(0, ENDLESS_S - 1, f"seconds 0..{ENDLESS_S - 1}")


@dataclass(frozen=True, slots=True)
class NavProfile:
    """The differences between INAV, whose values are the defaults, and MultiWii NAV. INAV stores no POSHOLD_UNLIM.

    capacity: records, without home. endless_hold: action and p1 of an endless hold. sea_level: altitudes may refer to
    mean sea level. leg_speed: legs may have a speed. rth_height: an RTH may have an altitude. jumps_back_only: a JUMP
    must go back, and no other may be in its loop. If False, it may go to any leg that is not adjacent. longest_hold: s.
    ends_on_any_record: the end of a list is noticed on a SET_POI or SET_HEAD, too. own_rth_landing: an RTH's own p1
    decides if it lands, else the last record's p1 does. limits: its own settings; None if unknown.
    """

    capacity: int = INAV_CAPACITY
    limits: BoardLimits | None = None
    endless_hold: tuple[NavAction, int] = (NavAction.POSHOLD_TIME, ENDLESS_S)
    sea_level: bool = True
    leg_speed: bool = True
    rth_height: bool = False
    jumps_back_only: bool = False
    longest_hold: Range = HOLD
    ends_on_any_record: bool = True
    own_rth_landing: bool = False

    @property
    def max_items(self) -> int:
        """The longest list that may fit: every record with a change of speed before it, and home."""
        return (2 if self.leg_speed else 1) * self.capacity + 1


class AltitudeUse(Enum):
    """The meaning of a command's altitude."""

    FLOWN = auto()
    #: The altitude of an RTH, if the firmware has one.
    RTH = auto()
    #: The start of the landing; 0, as planners send it, means the altitude of the leg before.
    APPROACH = auto()
    #: Stored but not flown.
    POINT = auto()


LANDS = Range(0, 1, "1 = land at home")
REPEATS = Range(-1, 32767, "repeats -1..32767")


@dataclass(frozen=True, slots=True)
class NavRule:
    """One row. p1: the range of the first parameter. position: required. If False, none is kept."""

    action: NavAction
    p1: Range
    position: bool
    height: AltitudeUse


_ROI = NavRule(NavAction.SET_POI, UNUSED, True, AltitudeUse.POINT)
#: Commands that become one record with only these fields. nav/check.py handles the others:
#: CONDITION_YAW, DO_SET_ROI_NONE, DO_JUMP, DO_CHANGE_SPEED.
NAV_RULES: Mapping[int, NavRule] = {
    Command.NAV_WAYPOINT: NavRule(NavAction.WAYPOINT, HOLD, True, AltitudeUse.FLOWN),
    Command.NAV_LOITER_UNLIM: NavRule(NavAction.POSHOLD_UNLIM, UNUSED, True, AltitudeUse.FLOWN),
    Command.NAV_LOITER_TURNS: NavRule(NavAction.WAYPOINT, UNUSED, True, AltitudeUse.FLOWN),
    Command.NAV_LOITER_TIME: NavRule(NavAction.POSHOLD_TIME, HOLD, True, AltitudeUse.FLOWN),
    Command.NAV_RETURN_TO_LAUNCH: NavRule(NavAction.RTH, LANDS, False, AltitudeUse.RTH),
    Command.NAV_LAND: NavRule(NavAction.LAND, UNUSED, True, AltitudeUse.APPROACH),
    **dict.fromkeys(ROI_COMMANDS, _ROI),
}
