# SPDX-License-Identifier: GPL-3.0-or-later
"""Problems in mission files of all formats: the error, the notes about fixes, and common checks.

A file without a mission is named by the content, so that a person learns which file was chosen by mistake.
"""

import math
import re
from collections.abc import Callable, Iterable
from typing import NoReturn

from protocols.mission_item import degrees_to_e7
from protocols.plain_text import FileError, shown
from protocols.remedies import Fault


class MissionFileError(FileError):
    """A mission file cannot be read or written."""


#: Called with one sentence for each thing that was fixed while reading a file.
Note = Callable[[str], None]


#: The note on a file without a home, by its kind or by mistake.
NO_HOME = "the file has no home: give --home, or the craft's position is used"


def no_note(_text: str) -> None:
    """Drop the note."""


def refuse_other_plans(commands: Iterable[int], name: str) -> None:
    """Refuse a list of fence or rally points, which Mission Planner and QGroundControl store in the same formats."""
    kinds = {_OTHER_PLANS.get(command, "") for command in commands}
    if kinds and "" not in kinds:
        raise MissionFileError(name, "", *Fault.OTHER_PLAN(kinds=" and ".join(sorted(kinds))))


def file_degrees_to_e7(degrees: float, field: str, name: str, where: str) -> int | None:
    """Degrees * 1e7, None for NaN (not given). Raises MissionFileError if out of range.

    The rules treat an infinite coordinate as missing, because a ground station may send it. In a file it is damage.
    """
    e7 = degrees_to_e7(degrees)
    if e7 is None and not math.isnan(degrees):
        raise MissionFileError(name, where, *Fault.NOT_DEGREES(what=field, text=shown(degrees)))
    return e7


def refuse_decimal_comma(text: str, name: str, where: str) -> None:
    """Refuse a number with a comma: the program that wrote it would write the same again."""
    if _DECIMAL_COMMA.fullmatch(text):
        raise MissionFileError(name, where, *Fault.DECIMAL_COMMA(text=shown(text)))


_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d+,\d+\s*", re.ASCII)
#: MAV_CMD_NAV_FENCE_... and MAV_CMD_NAV_RALLY_POINT.
_OTHER_PLANS = dict.fromkeys(range(5000, 5005), "a fence") | {5100: "rally points"}

#: By the first bytes. A telemetry log has the time in eight bytes before each frame.
_BINARY = (
    (re.compile(rb"\0[\0-\xff]{7}[\xfd\xfe]"), "a telemetry log (.tlog)"),
    (re.compile(rb"\xa3\x95"), "an ArduPilot log (.bin)"),
    (re.compile(rb"ULog"), "a PX4 log (.ulg)"),
    (re.compile(rb"\x7fELF"), "a firmware image"),
    (re.compile(rb"\x89PNG|\xff\xd8\xff|GIF8"), "a picture"),
    (re.compile(rb"\x1f\x8b|7z\xbc\xaf|Rar!"), "a compressed archive"),
    (re.compile(rb"%PDF"), "a PDF document"),
)
#: As much of a line as tells the kind: some of the patterns take quadratic time.
_LONGEST = 200
#: By the first line that is not a comment: the fault, and the kind of file.
_TEXTS = (
    (re.compile(r"<(!doctype )?html.*", re.IGNORECASE), Fault.WEB_PAGE, ""),
    (re.compile(r"\d+(\s+[-+.\w]+){10,11}"), Fault.NO_HEADER, ""),
    (re.compile(r"RALLY\b.*"), Fault.OTHER_PLAN, "rally points"),
    (re.compile(r"-?\d+\.?\d*\s+-?\d+\.?\d*"), Fault.OTHER_PLAN, "a fence"),
    (re.compile(r"(H Product:|FMT,|loopIteration,).*"), Fault.OTHER_FILE, "a flight log"),
    (re.compile(r"\$G[A-Z]{4},.*"), Fault.OTHER_FILE, "a log of a GPS receiver"),
    (re.compile(r":[0-9A-F]{10,}", re.IGNORECASE), Fault.OTHER_FILE, "a firmware image"),
    (re.compile(r"(set|feature|aux|serial|defaults|batch|profile)\s.*", re.IGNORECASE), Fault.SETTINGS_FOR_MISSION, ""),
    (re.compile(r"[A-Za-z]\w*[,\s]+[-+.\d]+|\d+\t\d+\t\w+\t\S+\t\d+"), Fault.SETTINGS_FOR_MISSION, ""),
    (re.compile(r"[^,;\t]*([,;\t][^,;\t]*){2,}"), Fault.NO_TITLES, ""),
)


def refuse_stranger(data: bytes, line: str, name: str) -> NoReturn:
    """Refuse a file without a mission by the first bytes, or by the first line that is not a comment."""
    kind = next((kind for start, kind in _BINARY if start.match(data)), "a binary file" if "\0" in line else None)
    if kind is not None:
        raise MissionFileError(name, "", *Fault.OTHER_FILE(kind=kind))
    for start, fault, kind in _TEXTS:
        if start.fullmatch(line[:_LONGEST]):
            raise MissionFileError(name, "", *fault(kind=kind, kinds=kind))
    raise MissionFileError(name, "", *Fault.STRANGE_FILE(line=shown(line)))
