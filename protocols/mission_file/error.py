# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with a mission file, in words for the person who gave it to us."""

_LONGEST_QUOTE = 24


class MissionFileError(Exception):
    """One sentence: which file, where in it, what is wrong, what to do about it."""

    def __init__(self, name: str, where: str, what: str, remedy: str) -> None:
        place = f"{name}, {where}" if where else name
        super().__init__(f"{place}: {what}; {remedy}")


def shown(found: object) -> str:
    """Quote what was found in a file: printable, short, on one line."""
    if isinstance(found, list | dict):
        return "a list" if isinstance(found, list) else "an object"
    text = ascii(found)
    return text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}..."
