# SPDX-License-Identifier: GPL-3.0-or-later
"""Line numbers of the keys in a TOML file: the parser of the standard library does not provide them."""

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

#: One of these ends a value that began in an earlier line; other lines are skipped.
_ENDS = ("]", '"""', "'''")
#: The number of attempts at one value; if it does not end, the rest of the file has no line numbers.
_MOST_LOOKS = 200

Keys = tuple[str, ...]


def key_lines(text: str) -> Mapping[Keys, int]:
    """The lines, from 1, in which tables and the keys in them are first named in a valid file."""
    found: dict[Keys, int] = {}
    table: Keys = ()
    for number, statement, held in _statements(text):
        names = list(_names(held))
        if statement.lstrip().startswith("["):
            table = names.pop()
            found.setdefault(table, number)
            # [zenoh.transport] also names zenoh.
            found.setdefault(table[:1], number)
        for name in names:
            found.setdefault(table + name, number)
    return found


def _statements(text: str) -> Iterator[tuple[int, str, Mapping[str, Any]]]:
    """Yield the shortest runs of lines that are valid TOML: a table's header, or a key with its value."""
    statement, began, looks = "", 1, 0
    for number, line in enumerate(text.split("\n"), 1):
        if not statement:
            began, looks = number, 0
        may_end = not statement or any(end in line for end in _ENDS)
        statement += line + "\n"
        if not may_end:
            continue
        try:
            held = tomllib.loads(statement)
        except ValueError:
            looks += 1
            if looks == _MOST_LOOKS:
                return
            continue
        yield began, statement, held
        statement = ""


def _names(held: Mapping[str, Any]) -> Iterator[Keys]:
    """Yield the keys of a statement, one table level deep."""
    for key, value in held.items():
        yield (key,)
        inner = value[-1] if isinstance(value, list) and value else value
        if isinstance(inner, dict):
            yield from ((key, name) for name in inner)
