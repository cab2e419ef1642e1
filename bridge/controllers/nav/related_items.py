# SPDX-License-Identifier: GPL-3.0-or-later
"""Items that depend on others: a JUMP on the target, a LAND on the leg before, a change of speed on those after."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from bridge.missions.list_check import missing_coordinate
from protocols.float32 import is_single
from protocols.mission_item import Frame, MissionItem, MissionResult
from protocols.msp.nav import LEAST_SPEED_CMS, LEGS, NavRecord
from protocols.msp.nav_items import AS_SET
from reports.finding import Note, RejectingFinding, reject

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
            return f"nothing is kept from item {wanted} on"
        if records[target].action not in LEGS:
            return f"item {wanted} is not a waypoint"
        if self.back_only:
            return None if target < place else "it can only jump back"
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
