# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a record that no item can show, from other planners: kept if the leg is written again unchanged."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

from protocols.msp.nav import FLY_HOME, LEGS, NavAction, NavRecord
from protocols.msp.nav_items import HIGHEST_HEADING, leg_speed

_ABOVE_SEA = 1
#: The fields of a record that items do not show, by the action. Of these, only a LAND's p2 changes a flight.
_HIDDEN: Mapping[int, tuple[str, ...]] = {
    NavAction.WAYPOINT: ("p2",),
    NavAction.POSHOLD_UNLIM: ("p1", "p2"),
    NavAction.RTH: ("lat_e7", "lon_e7", "p2", "p3"),
    NavAction.SET_POI: ("p1", "p2"),
    NavAction.JUMP: ("lat_e7", "lon_e7", "alt_cm", "p3"),
    NavAction.SET_HEAD: ("lat_e7", "lon_e7", "alt_cm", "p2", "p3"),
    NavAction.LAND: ("p2",),
}


def flies_home(record: NavRecord) -> bool:
    """True if INAV replaces the leg's missing coordinates by home's."""
    return record.action in LEGS and not (record.lat_e7 or record.lon_e7)


def keep_unshown(records: Sequence[NavRecord], current: Sequence[NavRecord]) -> tuple[list[NavRecord], str]:
    """The records with the unshown values of those that they repeat, and those lost as text, "" if there are none.

    `current`: the list on the flight controller.
    """
    kept: list[NavRecord] = []
    left = [*current]
    for record in records:
        repeated = next((old for old in left if _repeats(record, old)), None)
        if repeated is None:
            kept.append(record)
        else:
            left.remove(repeated)
            kept.append(replace(repeated, flag=repeated.flag if repeated.flag == FLY_HOME else 0))
    lost = Counter(name for old in left for name in _unshown(old))
    return kept, ", ".join(f"{name} ({count})" for name, count in lost.items())


def _repeats(record: NavRecord, old: NavRecord) -> bool:
    """True if it has the shown values. Mission Planner truncates a sixteenth of all coordinates to the value below."""
    shown = _shown(old)
    if max(abs(record.lat_e7 - shown.lat_e7), abs(record.lon_e7 - shown.lon_e7)) > 1:
        return False
    return replace(record, lat_e7=shown.lat_e7, lon_e7=shown.lon_e7) == shown


def _shown(record: NavRecord) -> NavRecord:
    """The record without the values that the item does not show."""
    hidden = dict.fromkeys(_HIDDEN.get(record.action, ()), 0)
    record = replace(record, **{"p3": record.p3 & _ABOVE_SEA, "flag": 0, **hidden})
    match record.action:
        case NavAction.WAYPOINT | NavAction.LAND:
            return replace(record, p1=leg_speed(record, 0))
        case NavAction.POSHOLD_TIME:
            return replace(record, p2=leg_speed(record, 0))
        case NavAction.RTH:
            return replace(record, p1=int(record.p1 > 0))
        case NavAction.SET_HEAD if not 0 <= record.p1 <= HIGHEST_HEADING:
            return replace(record, p1=-1)
    return record


def _unshown(record: NavRecord) -> list[str]:
    names = []
    if record.p3 & ~_ABOVE_SEA:
        names.append("user actions")
    if record.flag == FLY_HOME and not flies_home(record):
        names.append("fly home")
    if record.action == NavAction.LAND and record.p2:
        names.append("ground elevation")
    return names
