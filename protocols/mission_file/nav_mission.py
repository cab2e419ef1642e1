# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions of MultiWii and INAV: the XML of INAV Configurator, mwp, EZ-GUI and WinGUI, and `wp` lines of INAV's CLI.

Both list the records that the flight controller stores; XML has degrees and metres, the command line degrees * 1e7
and centimetres. mwp keeps the planned home next to them (attributes home-x and home-y).

    <missionitem no="1" action="WAYPOINT" lat="51.4771" lon="0.0012" alt="15" parameter1="0" flag="165"/>
    wp 0 1 514771000 12000 1500 0 0 0 165
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from xml.etree.ElementTree import Element

from protocols.mission_file.error import NO_HOME, MissionFileError, Note, file_degrees_to_e7, refuse_decimal_comma
from protocols.mission_item import MissionItem
from protocols.msp.nav import LAST, NavAction, NavRecord
from protocols.msp.nav_items import home_item, items_from_records
from protocols.plain_text import shown
from protocols.remedies import Fault

_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?", re.ASCII | re.IGNORECASE)
#: Not `wp save` and the like.
_WP_LINE = re.compile(r"\s*wp\s+[-+\d]", re.ASCII | re.IGNORECASE)
_WP_NUMBERS = re.compile(r"\s*wp(?:\s+-?\d{1,10})+\s*", re.ASCII | re.IGNORECASE)
_ACTIONS = {int(action): action.name for action in NavAction}
_NAMED_ACTIONS = ", ".join(f"{name} ({number})" for number, name in _ACTIONS.items())
_INT16, _INT32 = 2**15 - 1, 2**31 - 1
#: The fields of a `wp` line after the number; INAV before 2.0 lacked p2 and p3.
_PLACE = ("action", "lat_e7", "lon_e7", "alt_cm")
_WP_FIELDS = {8: (*_PLACE, "p1", "p2", "p3", "flag"), 6: (*_PLACE, "p1", "flag")}


def has_wp_lines(text: str) -> bool:
    """True if the text holds `wp` lines of INAV's command line."""
    return any(_WP_LINE.match(line) for line in text.splitlines())


def read_nav_xml(root: Element, name: str, note: Note) -> list[MissionItem]:
    """Read the mission's items, home first. MissionFileError names the missionitem."""
    records = [_from_xml(item, name, f"missionitem {place}") for place, item in enumerate(root.iter("missionitem"), 1)]
    home = None
    for planned in root.iter("mwp"):
        lat, lon = (_degrees(planned.get(key, "0"), key, name, "mwp") for key in ("home-y", "home-x"))
        home = (lat, lon) if lat and lon else home
    return _items(records, home, name, note)


def read_wp_lines(text: str, name: str, note: Note) -> list[MissionItem]:
    """Read the `wp` lines of a `dump` or `diff all`, home first; other lines are skipped."""
    records = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not _WP_LINE.match(line):
            continue
        where, fields = f"line {number}", _WP_FIELDS.get(len(line.split()) - 2)
        if fields is None or not _WP_NUMBERS.fullmatch(line):
            raise MissionFileError(name, where, *Fault.NOT_A_WP_LINE(line=shown(line)))
        values = dict(zip(fields, map(int, line.split()[2:]), strict=True))
        if values["action"]:  # 0 fills the unused slots of a dump
            if values["action"] not in _ACTIONS:
                raise _unknown_action(values["action"], name, where)
            numbers = {key: _within(value, key, name, where) for key, value in values.items()}
            records.append(NavRecord(**numbers))
    return _items(records, None, name, note)


def write_nav_xml(records: Sequence[NavRecord], home: tuple[int, int] | None) -> str:
    """The records as INAV Configurator's and mwp's XML. `home`: degrees * 1e7."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<mission>", '\t<version value="2.3-pre8"/>']
    if home is not None:
        lines.append(f'\t<mwp home-x="{home[1] / 1e7:.7f}" home-y="{home[0] / 1e7:.7f}"/>')
    for number, record in enumerate(records, start=1):
        place = f'lat="{record.lat_e7 / 1e7:.7f}" lon="{record.lon_e7 / 1e7:.7f}" alt="{record.alt_cm / 100:g}"'
        params = f'parameter1="{record.p1}" parameter2="{record.p2}" parameter3="{record.p3}"'
        action = NavAction(record.action).name
        lines.append(f'\t<missionitem no="{number}" action="{action}" {place} {params} flag="{record.flag}"/>')
    return "".join(f"{line}\n" for line in (*lines, "</mission>"))


def _items(records: Sequence[NavRecord], home: tuple[int, int] | None, name: str, note: Note) -> list[MissionItem]:
    if not records:
        raise MissionFileError(name, "", *Fault.NO_ITEMS())
    missions = 1 + sum(record.flag == LAST for record in records[:-1])
    if missions > 1:
        raise MissionFileError(name, "", *Fault.MANY_MISSIONS(count=missions))
    if home is None:
        note(NO_HOME)
    unflagged = [replace(record, flag=0) if record.flag == LAST else record for record in records]
    return list(items_from_records(unflagged, home_item(home)))


def _from_xml(item: Element, name: str, where: str) -> NavRecord:
    action = item.get("action", "").upper()
    if action not in NavAction.__members__:
        raise _unknown_action(action, name, where)
    values = {"action": int(NavAction[action])}
    for key in ("lat", "lon"):
        values[f"{key}_e7"] = _degrees(item.get(key, "0"), key, name, where) or 0
    values["alt_cm"] = _within(round(_float(item.get("alt", "0"), "alt", name, where) * 100), "alt_cm", name, where)
    for field, key in {"p1": "parameter1", "p2": "parameter2", "p3": "parameter3", "flag": "flag"}.items():
        values[field] = _within(int(_float(item.get(key, "0"), key, name, where)), field, name, where)
    return NavRecord(**values)


def _unknown_action(action: object, name: str, where: str) -> MissionFileError:
    return MissionFileError(name, where, *Fault.UNKNOWN_ACTION(text=shown(action), actions=_NAMED_ACTIONS))


def _within(value: int, field: str, name: str, where: str) -> int:
    key, _, unit = field.partition("_")
    if abs(value) > (_INT32 if unit else _INT16):
        raise MissionFileError(name, where, *Fault.OUT_OF_RANGE(what=key, text=shown(value)))
    return value


def _degrees(text: str, key: str, name: str, where: str) -> int | None:
    return file_degrees_to_e7(_float(text, key, name, where), key, name, where)


def _float(text: str, key: str, name: str, where: str) -> float:
    refuse_decimal_comma(text, name, where)
    number = text.strip()
    if not _NUMBER.fullmatch(number) or abs(float(number)) > _INT32:
        raise MissionFileError(name, where, *Fault.NOT_A_NUMBER(what=key, text=shown(text)))
    return float(number)
