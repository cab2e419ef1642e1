# SPDX-License-Identifier: GPL-3.0-or-later
"""The error for an unreadable file, worded for the user."""

_LONGEST_QUOTE = 24


class FileError(Exception):
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
