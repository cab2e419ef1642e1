# SPDX-License-Identifier: GPL-3.0-or-later
"""DO_CHANGE_SPEED on flight controllers that store a speed with each leg."""

import math
from dataclasses import dataclass, field

from bridge.missions.list_check import given
from protocols.float32 import is_single
from protocols.mission_item import MissionItem
from protocols.msp.nav import LEAST_SPEED_CMS
from protocols.msp.nav_items import AS_SET, GROUND_SPEED
from reports.finding import Note

_MAX_SPEED_CMS = 32767


@dataclass(slots=True)
class LegSpeed:
    """cms: the speed of the legs that follow, cm/s; 0: as set on the flight controller.

    waiting: a change of speed that no leg follows yet.
    """

    cms: int = 0
    waiting: MissionItem | None = None
    #: The numbers of the items that changed the speed, and the speed at each JUMP by its record's place.
    changed_at: list[int] = field(default_factory=list)
    at_jump: dict[int, int] = field(default_factory=dict)

    @staticmethod
    def leaves_it(item: MissionItem) -> bool:
        """True if a change of speed means "no change"."""
        return not math.isfinite(item.p2) or (item.p2 <= 0 and item.p2 != AS_SET)

    def change(self, item: MissionItem, note: Note) -> None:
        self.waiting = item
        self.changed_at.append(item.seq)
        if item.p1 != GROUND_SPEED:
            note(item, "p1", given(item.p1), GROUND_SPEED, "speed over ground")
        if item.p2 == AS_SET:
            self.cms = 0
            return
        self.cms = min(max(round(min(item.p2, _MAX_SPEED_CMS) * 100), LEAST_SPEED_CMS), _MAX_SPEED_CMS)
        if not is_single(item.p2, self.cms / 100):
            note(item, "p2", item.p2, self.cms / 100, "0.5..327.67 m/s in cm/s")
