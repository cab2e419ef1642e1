# SPDX-License-Identifier: GPL-3.0-or-later
"""The error for an unreadable mission file, and the notes about a readable one."""

from collections.abc import Callable, Iterable

from protocols.file_error import FileError


class MissionFileError(FileError):
    """A mission file cannot be read or written."""


#: Called with one sentence for each thing that was fixed while reading a file.
Note = Callable[[str], None]


def no_note(_text: str) -> None:
    """Drop the note."""


def refuse_other_plans(commands: Iterable[int], name: str) -> None:
    """Refuse a list of fence or rally points, which Mission Planner and QGroundControl store in the same formats."""
    kinds = {_OTHER_PLANS.get(command, "") for command in commands}
    if kinds and "" not in kinds:
        raise MissionFileError(
            name, "", f"this file holds {' and '.join(sorted(kinds))}", "give the mission's own file"
        )


#: MAV_CMD_NAV_FENCE_... and MAV_CMD_NAV_RALLY_POINT.
_OTHER_PLANS = dict.fromkeys(range(5000, 5005), "a fence") | {5100: "rally points"}
