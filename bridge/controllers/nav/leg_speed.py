# SPDX-License-Identifier: GPL-3.0-or-later
"""DO_CHANGE_SPEED on a flight controller whose legs each have a speed of their own."""

import math
from dataclasses import dataclass, field

from bridge.controllers.nav.items import AS_SET, GROUND_SPEED
from bridge.controllers.nav.rules import LEAST_SPEED_CMS
from bridge.missions.list_check import given
from bridge.model.finding import Note
from protocols.float32 import is_single
from protocols.mission_item import MissionItem

_MAX_SPEED_CMS = 32767


@dataclass(slots=True)
class LegSpeed:
    """cms: the speed of the legs that follow, cm/s; 0: as set on the flight controller.

    waiting: the change of speed with which no leg is flown yet.
    """

    cms: int = 0
    waiting: MissionItem | None = None
    #: Numbers of the items that changed it, and the speed at each JUMP by its record's place.
    changed_at: list[int] = field(default_factory=list)
    at_jump: dict[int, int] = field(default_factory=dict)

    def fault(self, item: MissionItem) -> tuple[str, float | None, str] | None:
        """Tell why a change of speed is none: field, value, reason."""
        if math.isfinite(item.p1) and item.p1 not in (0, GROUND_SPEED):
            return "p1", item.p1, "speed over ground only"
        return None

    @staticmethod
    def leaves_it(item: MissionItem) -> bool:
        """Whether a change of speed means "leave it as it is"."""
        return not math.isfinite(item.p2) or (item.p2 <= 0 and item.p2 != AS_SET)

    def change(self, item: MissionItem, note: Note) -> None:
        """Take one that has no fault."""
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
