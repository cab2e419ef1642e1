# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's mission commands: the rules by command (the table of docs/mission-rules.md), and records as items."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType

from bridge.missions.list_check import UNUSED, Range
from protocols.mission_item import ROI_COMMANDS, Command, Frame, MissionItem
from protocols.msp.mission import WpCommand, WpRecord

MAV_COMMANDS: Mapping[int, Command] = {
    WpCommand.WAYPOINT: Command.NAV_WAYPOINT,
    WpCommand.LOITER_UNLIM: Command.NAV_LOITER_UNLIM,
    WpCommand.LOITER_TURNS: Command.NAV_LOITER_TURNS,
    WpCommand.LOITER_TIME: Command.NAV_LOITER_TIME,
    WpCommand.RETURN_TO_LAUNCH: Command.NAV_RETURN_TO_LAUNCH,
    WpCommand.LAND: Command.NAV_LAND,
    WpCommand.TAKEOFF: Command.NAV_TAKEOFF,
    WpCommand.SETROI: Command.NAV_ROI,
}
_UNKNOWN_COMMAND = 0
_NONE_KNOWN: Mapping[int, int] = MappingProxyType({})

#: The capacity with default settings. Patched boards report theirs.
USUAL_CAPACITY = 146
USUAL_WP_RADIUS_CM = 200
#: The user manual's limit. The firmware itself would take 255.
TAKEOFF_MAX_M = 15
_MAX_RADIUS_M = 255


class InList(Enum):
    """The allowed places of a command, in the list as received and as kept."""

    ANY = auto()
    ITEM_1 = auto()
    LAST = auto()
    NOT_LAST = auto()


BRAKE = Range(0, 1, "0 = fly through, 1 = brake; to hold use LOITER_TIME")
TURNS = Range(-127, 127, "turns -127..127", instead_of_zero=1)
SECONDS = Range(1, 255, "seconds 1..255")
NOSE_ON_ROI = Range(0, 1, "1 = nose on the ROI")
NO_ROI_KNOWN = Range(0, 0, "no ROI is known")
CRUISE = Range(-32767, 32767, "-32767..32767 m", instead_of_zero=2)


@dataclass(frozen=True, slots=True)
class CommandRule:
    """One row: the storable fields of one command. param3 is 0 for every command.

    position: required, else the item is dropped. If False, latitude and longitude are stored as 0.
    alone: False if the mission needs another command besides this (and ROIs).
    """

    record: WpCommand
    p1: Range
    p2: Range
    p4: Range
    position: bool
    height: Range
    place: InList = InList.ANY
    alone: bool = True

    @property
    def name(self) -> str:
        """The command's name in Mission Planner's list."""
        return "ROI" if self.record is WpCommand.SETROI else self.record.name


def command_rules(wp_radius_cm: int, takeoff_max_m: int) -> Mapping[int, CommandRule]:
    """The table: MAV_CMD number to rule. A command without a rule cannot be stored.

    gps_wp_radius is rounded up to whole metres, so that no stored radius is smaller than it.
    """
    least = min(math.ceil(wp_radius_cm / 100), _MAX_RADIUS_M)
    radius = Range(least, _MAX_RADIUS_M, f"{least}..{_MAX_RADIUS_M} m")
    climb = Range(2, takeoff_max_m, f"take-off 2..{takeoff_max_m} m")
    # fmt: off
    rows = (
        #           record                      p1       p2      p4           position height  place           alone
        CommandRule(WpCommand.WAYPOINT,         BRAKE,   radius, NOSE_ON_ROI, True,    CRUISE),
        CommandRule(WpCommand.LOITER_UNLIM,     UNUSED,  radius, NOSE_ON_ROI, True,    CRUISE, InList.LAST),
        CommandRule(WpCommand.LOITER_TURNS,     TURNS,   radius, UNUSED,      True,    CRUISE),
        CommandRule(WpCommand.LOITER_TIME,      SECONDS, radius, NOSE_ON_ROI, True,    CRUISE),
        CommandRule(WpCommand.RETURN_TO_LAUNCH, UNUSED,  UNUSED, UNUSED,      False,   CRUISE, InList.ANY,      False),
        CommandRule(WpCommand.LAND,             UNUSED,  UNUSED, UNUSED,      False,   UNUSED, InList.LAST,     False),
        CommandRule(WpCommand.TAKEOFF,          UNUSED,  UNUSED, UNUSED,      False,   climb,  InList.ITEM_1,   False),
        CommandRule(WpCommand.SETROI,           UNUSED,  UNUSED, UNUSED,      True,    UNUSED, InList.NOT_LAST, False),
    )
    # fmt: on
    rules: dict[int, CommandRule] = {MAV_COMMANDS[row.record]: row for row in rows}
    return rules | dict.fromkeys(ROI_COMMANDS, rules[Command.NAV_ROI])


def items_from_records(records: Iterable[WpRecord], sent_as: Mapping[int, int] = _NONE_KNOWN) -> list[MissionItem]:
    """The items of a stored list (docs/mission-rules.md, "Read-back").

    Frame 3, home frame 0. A region of interest gets the command number from `sent_as` (stored seq to MAV_CMD), else
    80. A record with an unknown WpCommand becomes MAV_CMD 0, with the raw number as param1: no ground station
    treats that as a flight command, and the rules would drop it (our own choice).
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
