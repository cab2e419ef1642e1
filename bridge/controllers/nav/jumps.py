# SPDX-License-Identifier: GPL-3.0-or-later
"""Resolves JUMP targets to the flight controller's numbers: records from 1, without dropped or merged items."""

from dataclasses import dataclass, field, replace

from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.nav import LEGS, NavRecord
from reports.finding import Note, RejectingFinding, reject

#: INAV does not arm with a JUMP to a closer record (navigation.c, navigationIsBlockingArming).
_NEAREST = 2


@dataclass(slots=True)
class Jumps:
    """The state needed to resolve a list's JUMPs.

    back_only: True if they may only go back. places: for each item, the number of records before it. dropped: the
    numbers of dropped items. wanted: for each JUMP, its record's place and the item.
    """

    back_only: bool
    places: list[int] = field(default_factory=list)
    dropped: set[int] = field(default_factory=set)
    wanted: list[tuple[int, MissionItem]] = field(default_factory=list)

    def aim(self, records: list[NavRecord], note: Note) -> RejectingFinding | None:
        """Set the target of each JUMP in `records`; rejects one that the flight controller would not fly."""
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
