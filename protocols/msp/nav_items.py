# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts the records of INAV and MultiWii NAV to items for ground stations.

A leg's speed is shown as a DO_CHANGE_SPEED before it, so a list may have more items than records. Home (item 0) is not
a record.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate
from types import MappingProxyType

from protocols.mission_item import ROI_COMMANDS, Command, Frame, MissionItem
from protocols.msp.nav import ENDLESS_S, LEAST_SPEED_CMS, NavAction, NavRecord

_NONE_KNOWN: Mapping[int, int] = MappingProxyType({})
_UNKNOWN_COMMAND = 0
#: DO_CHANGE_SPEED: param1 ground speed, param2 "as set on the flight controller".
GROUND_SPEED, AS_SET = 1, -2
HIGHEST_HEADING = 359


def home_item(place: tuple[int, int] | None, alt_m: float = 0.0) -> MissionItem:
    """Item 0: home, if known. `place` in degrees * 1e7."""
    lat_e7, lon_e7 = place or (0, 0)
    return MissionItem(0, Command.NAV_WAYPOINT, Frame.GLOBAL, 0, 0, 0, 0, lat_e7, lon_e7, alt_m)


def items_from_records(
    records: Sequence[NavRecord], home: MissionItem, sent_as: Mapping[int, int] = _NONE_KNOWN
) -> tuple[MissionItem, ...]:
    """The items of a list. `sent_as`: a record's place (from 0) -> the MAV_CMD that it was sent as."""
    seqs = item_seqs(records)
    speeds = _shown_speeds(records)
    after = _speeds_after(records)
    items = [home]
    for place, record in enumerate(records):
        if place in speeds:
            speed_ms = speeds[place] / 100 if speeds[place] else AS_SET
            items.append(_item(len(items), Command.DO_CHANGE_SPEED, p1=GROUND_SPEED, p2=speed_ms))
        target = _jump_target(record, len(records))
        if record.action != NavAction.JUMP:
            items.append(_shown(len(items), record, sent_as.get(place)))
        elif target is None:
            items.append(_item(len(items), Command.DO_JUMP, p2=record.p2))
        else:
            # Jump to the speed change before the leg, unless the leg has the speed that is in force at the jump.
            is_same = leg_speed(records[target], after[place]) == after[place]
            items.append(_item(len(items), Command.DO_JUMP, p1=seqs[target] - (not is_same), p2=record.p2))
    return tuple(items)


def item_seqs(records: Sequence[NavRecord]) -> list[int]:
    speeds = _shown_speeds(records)
    return list(accumulate(2 if place in speeds else 1 for place in range(len(records))))


def sent_seqs(
    records: Sequence[NavRecord], record_seqs: Iterable[int], speed_seqs: Iterable[int]
) -> tuple[int | None, ...]:
    """The numbers as sent of the items that these records are read back as.

    `record_seqs`: of the item that each record was made from. `speed_seqs`: of the changes of speed, ascending.
    """
    home_seq = 0
    sent: list[int | None] = [home_seq]
    speeds = list(speed_seqs)
    for seq, record_seq in zip(item_seqs(records), record_seqs, strict=True):
        before = [speed for speed in speeds if speed < record_seq]
        if seq > len(sent):
            # A leg's speed is that of the last change before it, unless that is shown with an earlier leg.
            sent.append(before[-1] if before else None)
            speeds = speeds[len(before) :]
        sent.append(record_seq)
    return tuple(sent)


def _shown_speeds(records: Sequence[NavRecord]) -> dict[int, int]:
    """The DO_CHANGE_SPEED before a record, by the place, for each record at which the speed changes on any path."""
    after = _speeds_after(records)
    shown = {place: speed for place, speed in enumerate(after) if speed != (after[place - 1] if place else 0)}
    for place, record in enumerate(records):
        target = _jump_target(record, len(records))
        if target is not None and (speed := leg_speed(records[target], after[place])) != after[place]:
            shown[target] = speed
    return shown


def _speeds_after(records: Iterable[NavRecord]) -> list[int]:
    speed = 0
    return [speed := leg_speed(record, speed) for record in records]


def _jump_target(record: NavRecord, count: int) -> int | None:
    """The target place of a JUMP, or None for other records and for invalid targets."""
    return record.p1 - 1 if record.action == NavAction.JUMP and 1 <= record.p1 <= count else None


def leg_speed(record: NavRecord, before: int) -> int:
    """The speed in force after this record, cm/s; 0: as set on the flight controller."""
    match record.action:
        case NavAction.WAYPOINT | NavAction.LAND:
            speed = record.p1
        case NavAction.POSHOLD_TIME:
            speed = record.p2
        case _:
            return before
    return speed if speed >= LEAST_SPEED_CMS else 0


def _shown(seq: int, record: NavRecord, sent_as: int | None) -> MissionItem:
    match record.action:
        case NavAction.WAYPOINT:
            return _leg(seq, Command.NAV_WAYPOINT, record)
        case NavAction.POSHOLD_TIME if record.p1 == ENDLESS_S:
            return _leg(seq, Command.NAV_LOITER_UNLIM, record)
        case NavAction.POSHOLD_TIME:
            command = Command.NAV_WAYPOINT if sent_as == Command.NAV_WAYPOINT else Command.NAV_LOITER_TIME
            return _leg(seq, command, record, p1=record.p1)
        case NavAction.POSHOLD_UNLIM:
            return _leg(seq, Command.NAV_LOITER_UNLIM, record)
        case NavAction.RTH:
            return _item(seq, Command.NAV_RETURN_TO_LAUNCH, p1=int(record.p1 > 0), alt_m=record.alt_cm / 100)
        case NavAction.SET_POI:
            return _leg(seq, sent_as if sent_as in ROI_COMMANDS else Command.NAV_ROI, record)
        case NavAction.SET_HEAD if 0 <= record.p1 <= HIGHEST_HEADING:
            return _item(seq, Command.CONDITION_YAW, p1=record.p1)
        case NavAction.SET_HEAD:
            return _item(seq, Command.DO_SET_ROI_NONE)
        case NavAction.LAND:
            return _leg(seq, Command.NAV_LAND, record)
        case unknown:
            # No ground station treats MAV_CMD 0 as a flight command, and the rules would drop it.
            return _item(seq, _UNKNOWN_COMMAND, p1=unknown)


def _leg(seq: int, command: int, record: NavRecord, *, p1: int = 0) -> MissionItem:
    frame = Frame.GLOBAL if record.p3 & 1 else Frame.GLOBAL_RELATIVE_ALT
    place = (record.lat_e7, record.lon_e7, record.alt_cm / 100)
    return MissionItem(seq, int(command), int(frame), float(p1), 0.0, 0.0, 0.0, *place)


def _item(seq: int, command: int, *, p1: float = 0, p2: float = 0, alt_m: float = 0.0) -> MissionItem:
    frame = int(Frame.GLOBAL_RELATIVE_ALT)
    return MissionItem(seq, int(command), frame, float(p1), float(p2), 0.0, 0.0, 0, 0, alt_m)
