# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of an INAV in a file: its command line's `dump` or `diff all`, or a .param file of ours.

A dump is a list of commands: `set NAME = VALUE`, `safehome NUMBER ENABLED LAT LON` (degrees * 1e7) and others, which
are skipped. As INAV's command line does, this reads any case and any blanks: `SET nav_rth_altitude=2000`. A setting of
several profiles has the value of the first.
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

from protocols.msp.inav_places import Safehome
from protocols.param_file import read_param_file
from protocols.plain_text import FileError, file_text, plain_text, shown

_SET = re.compile(r"set\s+(\w+)\s*=(.*)", re.ASCII | re.IGNORECASE)
_SAFEHOME = re.compile(r"safehome\s+(\d{1,9})\s+([01])\s+(-?\d{1,10})\s+(-?\d{1,10})", re.ASCII | re.IGNORECASE)
_COMMAND = re.compile(r"(set|safehome)\b", re.ASCII | re.IGNORECASE)
_FORMS = {"set": "set NAME = VALUE", "safehome": "safehome NUMBER ENABLED LAT LON, in degrees * 1e7"}
_MAX_SIZE = 1 << 20


class InavDumpError(FileError):
    """The file cannot be read as INAV's settings."""


class SavedSettings(NamedTuple):
    """The values by name: of a choice its name, or its number from a .param file."""

    values: Mapping[str, float | str]
    safehomes: tuple[Safehome, ...] = ()


def read_inav_settings(data: bytes, name: str) -> SavedSettings:
    """Read a dump or a .param file; FileError names the file `name` and the line."""
    values: dict[str, float | str] = {}
    safehomes: list[Safehome] = []
    for number, line in enumerate(file_text(data[:_MAX_SIZE]).splitlines(), start=1):
        command = line.strip()
        if found := _SET.fullmatch(command):
            values.setdefault(found[1].lower(), plain_text(found[2].strip()))
        elif found := _SAFEHOME.fullmatch(command):
            place, enabled, lat_e7, lon_e7 = map(int, found.groups())
            safehomes.append(Safehome(place, bool(enabled), lat_e7, lon_e7))
        elif kind := _COMMAND.match(command):
            remedy = f"write {_FORMS[kind[1].lower()]}"
            raise InavDumpError(name, f"line {number}", f"{shown(command)} cannot be read", remedy)
    if not values:
        values.update(read_param_file(data, name).values)
    return SavedSettings(values, tuple(safehomes))
