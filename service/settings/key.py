# SPDX-License-Identifier: GPL-3.0-or-later
"""One setting: the name, the meaning, how the value is read, and the problems of a wrong value."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from reprlib import Repr
from typing import NamedTuple

_repr = Repr()
_repr.maxstring = _repr.maxother = _repr.maxlong = 80


class Default(str):
    """In a field's annotation: the default, as in the file, if it is not that of the field."""

    __slots__ = ()


class Example(str):
    """In a field's annotation: a value for the sample file, because there is no default to show."""

    __slots__ = ()


class Unfit(ValueError):
    """A value that cannot be used. The text continues a sentence after the key's name: "is 7, but must be ..."."""


@dataclass(frozen=True, slots=True)
class Problem:
    """`where`: file and line, or flag; may be empty. `text`: the problem, and the remedy."""

    where: str
    text: str

    def __str__(self) -> str:
        return f"{self.where}: {self.text}" if self.where else self.text


class SettingsError(ValueError):
    """Settings that cannot be used. One line per problem."""

    def __init__(self, problems: Sequence[Problem] | str) -> None:
        self.problems = (Problem("", problems),) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class Reader(NamedTuple):
    """Converts a given value to the value used. `read` gets the value, and the folder of the file.

    It raises Unfit, or another ValueError with a whole sentence. `choices`: all values, as in the file, if they can be
    listed.
    """

    read: Callable[[object, Path], object]
    choices: Sequence[object] = ()


@dataclass(frozen=True, slots=True)
class Key:
    """`name`: with the table, as "zenoh.prefix". `meaning`: one sentence, with the unit. `default`: as in the file.

    `example`: for the sample file, if there is no default.
    """

    name: str
    reader: Reader
    meaning: str
    default: str = ""
    example: str = ""


def short(value: object) -> str:
    """A value for a sentence: quoted if it is text, and shortened to a line."""
    try:
        return _repr.repr(value)
    except ValueError:
        # Python refuses to print a number of thousands of digits.
        return "far too large"


def _wrong(value: object, wanted: str) -> Unfit:
    return Unfit(f"is {short(value)}, but must be {wanted}")


def text(wanted: str = "text in quotes", parse: Callable[[str], object] = str) -> Reader:
    """Any text. `wanted` describes it, `parse` may reject it."""

    def read(value: object, _folder: Path) -> object:
        if not isinstance(value, str) or not value:
            raise _wrong(value, wanted)
        return parse(value)

    return Reader(read)


def file_name(*, in_config_folder: bool = False) -> Reader:
    """A file or folder. If `in_config_folder`, a relative path starts at the configuration file's folder."""

    def read(value: object, folder: Path) -> object:
        if not isinstance(value, str) or not value or "\0" in value:
            raise _wrong(value, "text in quotes: the name of a file or folder")
        return folder / value if in_config_folder else Path(value)

    return Reader(read)


def whole(least: int, most: int) -> Reader:
    def read(value: object, _folder: Path) -> object:
        if type(value) is not int:
            raise _wrong(value, f"a whole number, {least}..{most}")
        if not least <= value <= most:
            raise _wrong(value, f"{least}..{most}")
        return value

    return Reader(read, range(least, most + 1))


def yes_no() -> Reader:
    def read(value: object, _folder: Path) -> object:
        if type(value) is not bool:
            raise _wrong(value, "true or false")
        return value

    return Reader(read, (True, False))


def choice(kind: type[Enum]) -> Reader:
    """A word: the value of one member of `kind`."""

    def read(value: object, _folder: Path) -> object:
        try:
            return kind(value)
        except ValueError:
            raise _wrong(value, " or ".join(f'"{each.value}"' for each in kind)) from None

    return Reader(read, choices=[each.value for each in kind])


def several(wanted: str, parse: Callable[[object, Path], object], *, may_be_empty: bool = True) -> Reader:
    """A list, each entry read by `parse(entry, folder)`."""

    def read(value: object, folder: Path) -> object:
        if not isinstance(value, list):
            raise _wrong(value, f"a list in brackets, {wanted}")
        if not value and not may_be_empty:
            raise Unfit(f"is empty: give at least one, {wanted}, or omit it")
        return tuple(parse(entry, folder) for entry in value)

    return Reader(read)
