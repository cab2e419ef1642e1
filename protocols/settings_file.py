# SPDX-License-Identifier: GPL-3.0-or-later
"""A flight controller's settings in a file: a ground station's .param file, or what a command line prints.

INAV's, Betaflight's and Cleanflight's `dump` and `diff all` are lists of commands: `set NAME = VALUE`,
`safehome NUMBER ENABLED LAT LON` (degrees * 1e7) and others. As these command lines do, this reads any case and any
blanks: `SET nav_rth_altitude=2000`. Harakiri's `dump` has `NAME = VALUE`. Of profiles those count that the file selects
at the end, else the first.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

from protocols.msp.inav_places import Safehome
from protocols.param_file import BOARD, MOST_SETTINGS, ParamFileError, read_param_file
from protocols.plain_text import file_text, plain_text, shown
from protocols.remedies import Fault

_SET = re.compile(r"(?:set\s+)?(\w+)\s*=(.*)", re.ASCII | re.IGNORECASE)
_SAFEHOME = re.compile(r"safehome\s+(\d{1,9})\s+([01])\s+(-?\d{1,10})\s+(-?\d{1,10})", re.ASCII | re.IGNORECASE)
_COMMAND = re.compile(r"(set|safehome)\b", re.ASCII | re.IGNORECASE)
_PROFILE = re.compile(r"(\w*profile)\s+(\d{1,2})", re.ASCII | re.IGNORECASE)
_FORMS = {"set": "set NAME = VALUE", "safehome": "safehome NUMBER ENABLED LAT LON, in degrees * 1e7"}
#: Commands around the settings.
_FRAME = re.compile(r"#.*|batch (start|end)|defaults\b.*|save|exit|dump\b.*|diff\b.*", re.IGNORECASE)
#: "# INAV/MATEKF405 7.1.2 Jul 26 2024", "# Betaflight / STM32F7X2 (S7X2) 4.4.2 Jun 1 2023".
_VERSION = re.compile(r"#\s*(\w+)\s*/\s*\S+(?:\s+\(\S+\))?\s+(\d+\.\d+\.\d+)\b.*", re.ASCII)
_MAX_SIZE = 1 << 20
_SAVE = "save"


class SavedSettings(NamedTuple):
    """The values by name. A dump has texts, of a choice the name. A .param file has the number.

    board: the flight controller they are from, "" if the file lacks it. unread: the numbers of lines of a dump that are
    not settings, or of a profile that is not selected, and their first word.
    """

    values: Mapping[str, float | str]
    safehomes: tuple[Safehome, ...] = ()
    board: str = ""
    unread: tuple[tuple[int, str], ...] = ()


class _Line(NamedTuple):
    """A setting. profile: the kind and number, empty for none."""

    number: int
    name: str
    value: str
    profile: tuple[str, str]


def read_settings_file(data: bytes, name: str) -> SavedSettings:
    """Read a file of settings. ParamFileError names the file `name` and the line."""
    lines: list[_Line] = []
    safehomes: list[Safehome] = []
    unread: list[tuple[int, str]] = []
    board, profile, is_dump = "", ("", ""), False
    first: dict[str, str] = {}
    selected: dict[str, str] = {}
    if len(data) > _MAX_SIZE:
        raise ParamFileError(name, "", *Fault.LONG_SETTINGS())
    for number, line in enumerate(file_text(data).splitlines(), start=1):
        command = line.strip()
        if found := _SET.fullmatch(command):
            lines.append(_Line(number, found[1].lower(), plain_text(found[2].strip()), profile))
            first.setdefault(*profile)
            selected.pop(profile[0], None)
        elif found := _SAFEHOME.fullmatch(command):
            place, enabled, lat_e7, lon_e7 = map(int, found.groups())
            safehomes.append(Safehome(place, bool(enabled), lat_e7, lon_e7))
        elif found := _COMMAND.match(command):
            fault = Fault.BAD_COMMAND(line=shown(command), form=_FORMS[found[1].lower()])
            raise ParamFileError(name, f"line {number}", *fault)
        elif found := _PROFILE.fullmatch(command):
            profile = found[1].lower(), found[2]
            selected[profile[0]] = profile[1]
        elif found := _VERSION.fullmatch(command):
            board = board or f"{found[1]} {found[2]}"
        elif command.startswith(BOARD):
            board = plain_text(command.removeprefix(BOARD))
        elif command and not _FRAME.fullmatch(command):
            unread.append((number, plain_text(command.split()[0])))
        elif command and not command.startswith("#"):
            is_dump = True
    if is_dump and not lines:
        raise ParamFileError(name, "", *Fault.NO_SETTINGS())
    if not lines:
        params = read_param_file(data, name)
        return SavedSettings(params.values, tuple(safehomes), params.board)
    chosen = first | selected
    values = {line.name: line.value for line in lines if chosen[line.profile[0]] == line.profile[1]}
    if len(values) > MOST_SETTINGS:
        raise ParamFileError(name, "", *Fault.MANY_SETTINGS(most=MOST_SETTINGS))
    unread += [(line.number, " ".join(line.profile)) for line in lines if chosen[line.profile[0]] != line.profile[1]]
    return SavedSettings(values, tuple(safehomes), board, tuple(sorted(unread)))


def unread_text(unread: Iterable[tuple[int, str]]) -> str:
    """The lines for a person: "5 (feature), 7-12 (serial)"."""
    ranges = []
    # In a run of lines the number rises with the place.
    for (_, word), run in groupby(enumerate(unread), lambda each: (each[1][0] - each[0], each[1][1])):
        numbers = [number for _, (number, _) in run]
        span = f"{numbers[0]}-{numbers[-1]}" if numbers[1:] else f"{numbers[0]}"
        ranges.append(f"{span} ({word})")
    return ", ".join(ranges)


def write_dump(values: Mapping[str, str], board: str, comments: Sequence[str] = ()) -> str:
    """The values as commands for the board's command line. Mode ranges, which it has as `aux`, are comments."""
    commands = (f"{'# ' if name.startswith('MODE_') else 'set '}{name} = {value}" for name, value in values.items())
    heading = [BOARD + board, *(f"# {comment}" for comment in comments)]
    return "".join(f"{line}\n" for line in (*heading, *commands, _SAVE))
