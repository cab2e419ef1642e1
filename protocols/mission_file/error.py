# SPDX-License-Identifier: GPL-3.0-or-later
"""Problems in mission files of all formats: the error, the notes about fixes, and common checks."""

import math
from collections.abc import Callable, Iterable

from protocols.mission_item import degrees_to_e7
from protocols.plain_text import FileError, shown


class MissionFileError(FileError):
    """A mission file cannot be read or written."""


#: Called with one sentence for each thing that was fixed while reading a file.
Note = Callable[[str], None]


#: The note on a file of a kind that has no home, or lacks it.
NO_HOME = "the file has no home: the craft's position is used, or --home"


def no_note(_text: str) -> None:
    """Drop the note."""


def refuse_other_plans(commands: Iterable[int], name: str) -> None:
    """Refuse a list of fence or rally points, which Mission Planner and QGroundControl store in the same formats."""
    kinds = {_OTHER_PLANS.get(command, "") for command in commands}
    if kinds and "" not in kinds:
        raise MissionFileError(
            name, "", f"this file holds {' and '.join(sorted(kinds))}", "give the mission's own file"
        )


def file_degrees_to_e7(degrees: float, field: str, name: str, where: str) -> int | None:
    """Degrees * 1e7, None for NaN (not given); MissionFileError if out of range.

    The rules treat an infinite coordinate as missing, because a ground station may send it; in a file it is damage.
    """
    e7 = degrees_to_e7(degrees)
    if e7 is None and not math.isnan(degrees):
        raise MissionFileError(name, where, f"{field} is {shown(degrees)}", "give it in degrees")
    return e7


#: MAV_CMD_NAV_FENCE_... and MAV_CMD_NAV_RALLY_POINT.
_OTHER_PLANS = dict.fromkeys(range(5000, 5005), "a fence") | {5100: "rally points"}
