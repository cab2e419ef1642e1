# SPDX-License-Identifier: GPL-3.0-or-later
"""QGC WPL 110, the text format of Mission Planner and most others (https://mavlink.io/en/file_formats/).

Version 120, as QGroundControl wrote it for PX4 from 2011 on, has the same fields but lacks home. Version 100 is older
than MAVLink 1: other numbers of commands, another order of fields (pymavlink's mavwp.py).

A header line, then one item a line: seq, current, frame, command, param1..4, latitude, longitude, altitude and
autocontinue. Usually separated by tabs. Any white space, commas and semicolons are accepted. Empty lines and lines that
start with # are ignored. As in Mission Planner's reader these are fixed, with a note: items not numbered 0, 1, 2...,
no home, home with command 0, no autocontinue.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import replace

from protocols.mission_file.error import (
    NO_HOME,
    MissionFileError,
    Note,
    file_degrees_to_e7,
    no_note,
    refuse_decimal_comma,
    refuse_other_plans,
)
from protocols.mission_item import Command, Frame, MissionItem, behind_home
from protocols.plain_text import shown
from protocols.remedies import Fault

_HEADER, _VERSIONS = ["QGC", "WPL"], ("100", "110", "120")
#: Version 100: the place of each of version 110's fields, and the commands by its numbers.
_ORDER_100 = (0, 7, 1, 2, 5, 6, 3, 4, 9, 8, 10, 12)
_COMMANDS_100 = {
    "2": Command.NAV_TAKEOFF,
    "3": Command.NAV_RETURN_TO_LAUNCH,
    "4": Command.NAV_LAND,
    "24": Command.NAV_TAKEOFF,
    "25": Command.NAV_WAYPOINT,
    "26": Command.NAV_LAND,
    "27": Command.NAV_LOITER_UNLIM,
}
_INTEGER_FIELDS = {"seq": 65535, "current": 255, "frame": 255, "command": 65535}
_NUMBER_FIELDS = ("param1", "param2", "param3", "param4", "latitude", "longitude", "altitude", "autocontinue")
_FIELD_COUNT = len(_INTEGER_FIELDS) + len(_NUMBER_FIELDS)
# float() and int() also accept underscores and digits of any script, which ground stations do not write.
_INTEGER = re.compile(r"\d{1,9}", re.ASCII)
_NUMBER = re.compile(r"[-+]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?|nan|inf|infinity)", re.ASCII | re.IGNORECASE)
_NO_ITEM_0 = "there is no item 0: home is missing"


def has_header(line: str) -> bool:
    """True if the line begins as the header of any version."""
    return [word.upper() for word in line.split()[:2]] == _HEADER


def read_qgc_wpl(text: str, name: str, note: Note = no_note) -> list[MissionItem]:
    """Read the items, home first. MissionFileError names the file and the line.

    A file without items is an error: it is more likely truncated than meant to erase a mission.
    """
    items: list[MissionItem] = []
    version = ""
    lines = text.split("\n")
    for number, line in enumerate(lines, start=1):
        fields = _fields(line)
        if not fields or line.startswith("#"):
            continue
        where = f"line {number}"
        if version:
            if version == "100":
                fields = _fields_110(fields, name, where)
            if len(fields) == _FIELD_COUNT - 1 and number < len(lines):
                # Missing in an unterminated last line, it would mean a truncated line.
                note(f"{where}: autocontinue is missing")
                fields.append("1")
            items.append(_item(fields, name, where))
        elif has_header(line) and fields[2:] in ([each] for each in _VERSIONS):
            version = fields[2]
        else:
            raise MissionFileError(name, where, *Fault.UNKNOWN_HEADER(header=shown(line)))
    if not items:
        raise MissionFileError(name, "", *Fault.NO_ITEMS())
    refuse_other_plans([item.command for item in items[1:]], name)
    return _numbered(items, note, has_home=version != "120")


def _fields_110(fields: list[str], name: str, where: str) -> list[str]:
    """The fields of version 100 in the order of version 110."""
    if len(fields) != len(_ORDER_100) + 1:
        raise MissionFileError(name, where, *Fault.TRUNCATED_LINE(count=len(fields), wanted=len(_ORDER_100) + 1))
    ordered = [fields[place] for place in _ORDER_100]
    command = _COMMANDS_100.get(ordered[3])
    if command is None:
        raise MissionFileError(name, where, *Fault.OUT_OF_RANGE(what="the command", text=shown(ordered[3])))
    ordered[3] = str(int(command))
    return ordered


def _fields(line: str) -> list[str]:
    """The fields of a line. Commas separate them unless tabs or semicolons do."""
    line = line.replace(";", "\t")
    if "\t" not in line and line.count(",") >= _FIELD_COUNT - 2:
        return [field.strip() for field in line.split(",")]
    return line.split()


def _numbered(items: list[MissionItem], note: Note, *, has_home: bool) -> list[MissionItem]:
    """Number the items by their order, as Mission Planner does."""
    if not has_home or items[0].seq != 0:
        note(_NO_ITEM_0 if has_home else NO_HOME)
        home = replace(items[0], seq=0, command=0, lat_e7=None, lon_e7=None, alt_m=0.0)
        items = [home, *items] if has_home else behind_home(items, home)
    elif items[0].command == 0:
        note("home has command 0, treated as a WAYPOINT")
    if items[0].command == 0:
        items[0] = replace(items[0], command=int(Command.NAV_WAYPOINT), frame=int(Frame.GLOBAL))
    odd = next((place for place, item in enumerate(items) if item.seq != place), None)
    if odd is not None:
        note(f"item {items[odd].seq} where item {odd} was expected: renumbered by their order")
    return [replace(item, seq=place) for place, item in enumerate(items)]


def write_qgc_wpl(items: Sequence[MissionItem]) -> str:
    """The items as a file's text. `read_qgc_wpl` reads the same items again."""
    return "".join(f"{line}\n" for line in ["QGC WPL 110", *map(_line, items)])


def _item(fields: list[str], name: str, where: str) -> MissionItem:
    if len(fields) != _FIELD_COUNT:
        raise MissionFileError(name, where, *Fault.TRUNCATED_LINE(count=len(fields), wanted=_FIELD_COUNT))
    for token in fields:
        refuse_decimal_comma(token, name, where)
    integers = []
    for (field, highest), token in zip(_INTEGER_FIELDS.items(), fields, strict=False):
        if not _INTEGER.fullmatch(token) or int(token) > highest:
            raise MissionFileError(name, where, *Fault.NOT_WHOLE(what=field, text=shown(token), most=highest))
        integers.append(int(token))
    for field, token in zip(_NUMBER_FIELDS, fields[len(integers) :], strict=True):
        if not _NUMBER.fullmatch(token):
            raise MissionFileError(name, where, *Fault.NOT_A_NUMBER(what=field, text=shown(token)))
    seq, _, frame, command = integers
    p1, p2, p3, p4, lat, lon, alt_m, _ = map(float, fields[len(integers) :])
    lat_e7 = file_degrees_to_e7(lat, "latitude", name, where)
    lon_e7 = file_degrees_to_e7(lon, "longitude", name, where)
    return MissionItem(seq, command, frame, p1, p2, p3, p4, lat_e7, lon_e7, alt_m)


def _line(item: MissionItem) -> str:
    current = 0 if item.seq else 1
    params = (item.p1, item.p2, item.p3, item.p4)
    place = (_degrees(item.lat_e7), _degrees(item.lon_e7), _number(item.alt_m))
    fields = (item.seq, current, item.frame, item.command, *map(_number, params), *place, 1)
    return "\t".join(map(str, fields))


def _degrees(e7: int | None) -> str:
    return "NaN" if e7 is None else f"{e7 / 1e7:.7f}"


def _number(value: float) -> str:
    """Write the shortest text that reads back as the same number; "NaN" as .NET spells it."""
    if math.isnan(value):
        return "NaN"
    return f"{value:.0f}" if float(value).is_integer() and abs(value) < 1e15 else repr(value)
