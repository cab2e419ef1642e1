# SPDX-License-Identifier: GPL-3.0-or-later
"""The mission rules of INAV and MultiWii NAV by command (the table of docs/inav.md), and items that depend on others.

These are a JUMP on the target, a LAND on the leg before, and a change of speed on the legs after it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto

from bridge.controllers.nav.flown_path import BoardLimits
from bridge.missions.list_check import UNUSED, Range, missing_coordinate
from protocols.float32 import is_single
from protocols.mission_item import ROI_COMMANDS, Command, Frame, MissionItem, MissionResult
from protocols.msp.nav import ENDLESS_S, LEAST_SPEED_CMS, LEGS, NavAction, NavRecord
from protocols.msp.nav_items import AS_SET
from reports.finding import Note, RejectingFinding, reject

Mission = tuple[NavRecord, ...]

#: Records.
INAV_CAPACITY = 120
#: The height above home that replaces 0, metres.
LEAST_HEIGHT_M = 2
HOLD = Range(0, ENDLESS_S - 1, f"seconds 0..{ENDLESS_S - 1}")


@dataclass(frozen=True, slots=True)
class NavProfile:
    """The differences between INAV, whose values are the defaults, and MultiWii NAV. INAV does not store POSHOLD_UNLIM.

    capacity: records, without home. endless_hold: action and p1 of an endless hold. sea_level: altitudes may refer to
    mean sea level. leg_speed: legs may have a speed. rth_height: an RTH may have an altitude. jumps_back_only: a JUMP
    must go back, and no other may be in its loop. If False, it may go to any leg that is not adjacent. longest_hold: s.
    ends_on_any_record: the end of a list is noticed on a SET_POI or SET_HEAD, too. own_rth_landing: an RTH's own p1
    decides if it lands, else the last record's p1 does. limits: its own settings, or None if unknown.
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


#: INAV does not arm with a JUMP to a closer record (navigation.c, navigationIsBlockingArming).
_NEAREST = 2
#: The height of half a centimetre, which a record stores as 0.
_ROUNDED_TO_0_M = 0.005
_MAX_SPEED_CMS = 32767


@dataclass(slots=True)
class Jumps:
    """Resolves JUMP targets to the flight controller's numbers: records from 1, without dropped or merged items.

    back_only: True if they may only go back. places: for each item, the number of records before it. dropped: the
    numbers of dropped items. wanted: for each JUMP, the record's place and the item.
    """

    back_only: bool
    places: list[int] = field(default_factory=list)
    dropped: set[int] = field(default_factory=set)
    wanted: list[tuple[int, MissionItem]] = field(default_factory=list)

    def aim(self, records: list[NavRecord], note: Note) -> RejectingFinding | None:
        """Set the target of each JUMP in `records`. Rejects one that the flight controller would not fly."""
        for place, item in self.wanted:
            wanted = int(item.p1)
            target = self.places[wanted]
            fault = self._fault(place, wanted, records)
            if fault is not None:
                return reject(MissionResult.INVALID_PARAM1, item, "p1", fault)
            if wanted in self.dropped:
                goes_to = next(seq for seq in range(wanted, len(self.places)) if seq not in self.dropped)
                note(item, "p1", wanted, goes_to, f"item {wanted} is dropped")
            records[place] = replace(records[place], p1=target + 1)
        return None

    def _fault(self, place: int, wanted: int, records: list[NavRecord]) -> str | None:
        target = self.places[wanted]
        if target >= len(records):
            return f"items from {wanted} on are dropped"
        if records[target].action not in LEGS:
            return f"item {wanted} is not a waypoint"
        if self.back_only:
            return None if target < place else "jumps can only go back"
        if place == 0 or abs(target - place) < _NEAREST:
            return "it cannot jump to an adjacent item"
        return None


def placed_landing(item: MissionItem, records: Sequence[NavRecord], note: Note, warn: Note) -> MissionItem:
    """Fill in a LAND's missing position and altitude from the previous leg: ground stations send it without.

    INAV flies there at the LAND's own altitude: at 0 m it would hit any obstacle.
    """
    before = next((record for record in reversed(records) if record.action in LEGS), None)
    if before is None:
        return item
    if missing_coordinate(item):
        note(item, "lat_e7", item.lat_e7, before.lat_e7, "not given, end of the leg before")
        note(item, "lon_e7", item.lon_e7, before.lon_e7, "not given, end of the leg before")
        item = replace(item, lat_e7=before.lat_e7, lon_e7=before.lon_e7)
    if item.alt_m <= _ROUNDED_TO_0_M and before.alt_cm > 0:
        height_m = before.alt_cm / 100
        warn(item, "alt_m", item.alt_m, height_m, "flown there, then landed")
        frame = Frame.GLOBAL if before.p3 & 1 else Frame.GLOBAL_RELATIVE_ALT
        item = replace(item, alt_m=height_m, frame=int(frame))
    return item


@dataclass(slots=True)
class LegSpeed:
    """The speed that is stored with each leg.

    cms: of the legs that follow, cm/s; 0: as set on the flight controller.
    waiting: a change of speed that no leg follows yet.
    """

    cms: int = 0
    waiting: MissionItem | None = None
    #: The numbers of the items that changed the speed.
    changed_at: list[int] = field(default_factory=list)

    @staticmethod
    def leaves_it(item: MissionItem) -> bool:
        """True if a change of speed means "no change"."""
        return not math.isfinite(item.p2) or (item.p2 <= 0 and item.p2 != AS_SET)

    def change(self, item: MissionItem, note: Note) -> None:
        self.waiting = item
        self.changed_at.append(item.seq)
        if item.p2 == AS_SET:
            self.cms = 0
            return
        self.cms = min(max(round(min(item.p2, _MAX_SPEED_CMS) * 100), LEAST_SPEED_CMS), _MAX_SPEED_CMS)
        if not is_single(item.p2, self.cms / 100):
            note(item, "p2", item.p2, self.cms / 100, "0.5..327.67 m/s in cm/s")
