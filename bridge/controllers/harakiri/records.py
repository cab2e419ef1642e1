# SPDX-License-Identifier: GPL-3.0-or-later
"""A Harakiri's records as items for ground stations."""

from abc import ABC
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from bridge.controllers.harakiri.rules import MAV_COMMANDS
from bridge.missions.fc_mission_store import FcMissionStore
from protocols.mission_item import Command, Frame, MissionItem
from protocols.wp_record import WpRecord

_NONE_KNOWN: Mapping[int, int] = MappingProxyType({})
_UNKNOWN_COMMAND = 0


class HarakiriStore(FcMissionStore[WpRecord], ABC):
    """The mission store of a Harakiri, over either protocol: each record is an item, home too."""

    def items(self, records: Sequence[WpRecord], sent_as: Mapping[int, int]) -> tuple[MissionItem, ...]:
        """A list as a ground station reads it."""
        return tuple(items_from_records(records, sent_as))

    def seq_of(self, records: Sequence[WpRecord], number: int) -> int:
        """The same number."""
        return number if number < len(records) else 0


def items_from_records(records: Iterable[WpRecord], sent_as: Mapping[int, int] = _NONE_KNOWN) -> list[MissionItem]:
    """The items of a stored list (docs/mission-rules.md, "Read-back").

    Frame 3, home frame 0. A region of interest gets its command number from `sent_as` (stored seq to MAV_CMD), else
    80. A record with an unknown WpCommand becomes MAV_CMD 0, with the raw number as its param1: no ground station
    takes that for a flight command, and the rules would drop it (our own choice).
    """
    return [_item(seq, record, sent_as) for seq, record in enumerate(records)]


def _item(seq: int, record: WpRecord, sent_as: Mapping[int, int]) -> MissionItem:
    match MAV_COMMANDS.get(record.command):
        case None:
            command, p1 = _UNKNOWN_COMMAND, record.command
        case Command.NAV_LOITER_TURNS:
            command, p1 = int(Command.NAV_LOITER_TURNS), record.turns
        case Command.NAV_ROI:
            command, p1 = sent_as.get(seq, int(Command.NAV_ROI)), record.time
        case known:
            command, p1 = int(known), record.time
    return MissionItem(
        seq=seq,
        command=command,
        frame=int(Frame.GLOBAL_RELATIVE_ALT if seq else Frame.GLOBAL),
        p1=float(p1),
        p2=float(record.radius_m),
        p3=0.0,
        p4=float(record.roi_heading),
        lat_e7=record.lat_e7,
        lon_e7=record.lon_e7,
        alt_m=float(record.height_m),
    )
