# SPDX-License-Identifier: GPL-3.0-or-later
"""The error for an unreadable mission file, worded for the user."""

from collections.abc import Callable, Iterable

_LONGEST_QUOTE = 24


class MissionFileError(Exception):
    """One sentence: the file, the place in it, the problem, the remedy."""

    def __init__(self, name: str, where: str, what: str, remedy: str) -> None:
        place = f"{name}, {where}" if where else name
        super().__init__(f"{place}: {what}; {remedy}")


def shown(found: object) -> str:
    """Quote text from a file: printable, short, on one line."""
    if isinstance(found, list | dict):
        return "a list" if isinstance(found, list) else "an object"
    text = ascii(found)
    return text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}..."


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
