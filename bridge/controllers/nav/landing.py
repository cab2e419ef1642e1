# SPDX-License-Identifier: GPL-3.0-or-later
"""The place of a LAND without one: ground stations send it without a position, or with altitude 0."""

from collections.abc import Sequence
from dataclasses import replace

from bridge.missions.list_check import missing_coordinate
from protocols.mission_item import Frame, MissionItem
from protocols.msp.nav import LEGS, NavRecord
from reports.finding import Note

#: The height of half a centimetre, which a record stores as 0.
_ROUNDED_TO_0_M = 0.005


def placed_landing(item: MissionItem, records: Sequence[NavRecord], note: Note, warn: Note) -> MissionItem:
    """Fill in a LAND's missing position and altitude from the previous leg.

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
