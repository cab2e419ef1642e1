# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of an INAV in a file: its command line's `dump` or `diff all`, or a .param file of ours.

A dump is a list of commands: `set NAME = VALUE`, `safehome NUMBER ENABLED LAT LON` (degrees * 1e7) and others, which
are skipped. A setting of several profiles has the value of the first.
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

from protocols.file_error import FileError, shown
from protocols.msp.inav_places import Safehome
from protocols.param_file import read_param_file

_SET = re.compile(r"set (\w+) = (\S*)", re.ASCII)
_SAFEHOME = re.compile(r"safehome (\d{1,9}) ([01]) (-?\d{1,10}) (-?\d{1,10})", re.ASCII)
_MAX_SIZE = 1 << 20


class InavDumpError(FileError):
    """The file cannot be read as INAV's settings."""


class SavedSettings(NamedTuple):
    """The values by name: of a choice its name, or its number from a .param file."""

    values: Mapping[str, float | str]
    safehomes: tuple[Safehome, ...] = ()


def read_inav_settings(data: bytes, name: str) -> SavedSettings:
    """Read a dump or a .param file; FileError names the file `name` and the line."""
    text = data[:_MAX_SIZE].decode("utf-8", "replace")
    values: dict[str, float | str] = {}
    safehomes: list[Safehome] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if found := _SET.fullmatch(line.strip()):
            values.setdefault(found[1], found[2])
        elif found := _SAFEHOME.fullmatch(line.strip()):
            place, enabled, lat_e7, lon_e7 = map(int, found.groups())
            safehomes.append(Safehome(place, bool(enabled), lat_e7, lon_e7))
        elif line.startswith("safehome "):
            remedy = "write safehome NUMBER ENABLED LAT LON, in degrees * 1e7"
            raise InavDumpError(name, f"line {number}", f"{shown(line)} is not a safehome", remedy)
    if not values:
        values.update(read_param_file(data, name).values)
    return SavedSettings(values, tuple(safehomes))
