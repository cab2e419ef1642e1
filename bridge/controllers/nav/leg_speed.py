# SPDX-License-Identifier: GPL-3.0-or-later
"""DO_CHANGE_SPEED on a flight controller whose legs each have a speed of their own."""

import math
from dataclasses import dataclass

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

    def fault(self, item: MissionItem) -> tuple[str, float | None, str] | None:
        """Tell why a change of speed is none: field, value, reason."""
        if math.isfinite(item.p1) and item.p1 not in (0, GROUND_SPEED):
            return "p1", item.p1, "speed over ground only"
        if not math.isfinite(item.p2) or (item.p2 < 0 and item.p2 != AS_SET):
            return "p2", given(item.p2), "it changes nothing"
        return None

    def change(self, item: MissionItem, note: Note) -> None:
        """Take one that has no fault."""
        self.waiting = item
        if item.p1 != GROUND_SPEED:
            note(item, "p1", given(item.p1), GROUND_SPEED, "speed over ground")
        if item.p2 == AS_SET:
            self.cms = 0
            return
        self.cms = min(max(round(min(item.p2, _MAX_SPEED_CMS) * 100), LEAST_SPEED_CMS), _MAX_SPEED_CMS)
        if not is_single(item.p2, self.cms / 100):
            note(item, "p2", item.p2, self.cms / 100, "0.5..327.67 m/s in cm/s")
