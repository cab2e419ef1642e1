# SPDX-License-Identifier: GPL-3.0-or-later
"""One setting: its name, its meaning, how its value is read, and the problems of a wrong one."""

import tomllib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from reprlib import Repr

_ENVIRONMENT = "NAZE_BRIDGE_"
_repr = Repr()
_repr.maxstring = _repr.maxother = _repr.maxlong = 80


class Unfit(ValueError):
    """A value that cannot be used; the text continues a sentence after the key's name: "is 7, but must be ..."."""


@dataclass(frozen=True, slots=True)
class Problem:
    """`where`: file and line, environment variable or flag; may be empty. `text`: the problem, and the remedy."""

    where: str
    text: str

    def __str__(self) -> str:
        return f"{self.where}: {self.text}" if self.where else self.text


class SettingsError(ValueError):
    """Settings that cannot be used; one line per problem."""

    def __init__(self, problems: Sequence[Problem] | str) -> None:
        self.problems = (Problem("", problems),) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class Reader(ABC):
    """Converts a given value to the one used; raises Unfit, or another ValueError with a whole sentence."""

    @abstractmethod
    def read(self, value: object, folder: Path) -> object:
        """Read a value of the file in `folder`."""

    def from_text(self, text: str) -> object:
        """Convert text from the environment or a flag to the form of the file; most readers use it unchanged."""
        return text


@dataclass(frozen=True, slots=True)
class Key:
    """`name`: with its table, as "zenoh.prefix". `meaning`: one sentence, with the unit. `default`: as in the file.

    `example`: for the sample file, if there is no default. `is_live`: a reload applies it.
    """

    name: str
    reader: Reader
    meaning: str
    default: str = ""
    example: str = ""
    is_live: bool = False

    @property
    def variable(self) -> str:
        """The name of its environment variable."""
        return _ENVIRONMENT + self.name.upper().replace(".", "_")


def short(value: object) -> str:
    """A value for a sentence: quoted if it is text, and shortened to a line."""
    try:
        return _repr.repr(value)
    except ValueError:
        # Python refuses to print a number of thousands of digits.
        return "far too large"


def _wrong(value: object, wanted: str) -> Unfit:
    return Unfit(f"is {short(value)}, but must be {wanted}")


@dataclass(frozen=True, slots=True)
class Text(Reader):
    """Any text; `wanted` describes it, `parse` may reject it."""

    wanted: str = "text in quotes"
    parse: Callable[[str], object] = str

    def read(self, value: object, folder: Path) -> object:
        """Read a text."""
        if not isinstance(value, str) or not value:
            raise _wrong(value, self.wanted)
        return self.parse(value)


@dataclass(frozen=True, slots=True)
class FileName(Reader):
    """A file or folder; if `in_config_folder`, a relative path starts at the configuration file's folder."""

    in_config_folder: bool = False

    def read(self, value: object, folder: Path) -> object:
        """Read a path."""
        if not isinstance(value, str) or not value or "\0" in value:
            raise _wrong(value, "text in quotes: the name of a file or folder")
        return folder / value if self.in_config_folder else Path(value)


@dataclass(frozen=True, slots=True)
class Whole(Reader):
    """A whole number from `least` to `most`."""

    least: int
    most: int

    def read(self, value: object, folder: Path) -> object:
        """Read a number."""
        if type(value) is not int:
            raise _wrong(value, f"a whole number, {self.least}..{self.most}")
        if not self.least <= value <= self.most:
            raise _wrong(value, f"{self.least}..{self.most}")
        return value

    def from_text(self, text: str) -> object:
        """Read its digits."""
        return int(text) if text.isascii() and text.isdecimal() and len(text) < len(str(self.most)) + 2 else text


@dataclass(frozen=True, slots=True)
class YesNo(Reader):
    """True or false."""

    def read(self, value: object, folder: Path) -> object:
        """Read a truth value."""
        if type(value) is not bool:
            raise _wrong(value, "true or false")
        return value

    def from_text(self, text: str) -> object:
        """Read the word."""
        return {"true": True, "false": False}.get(text.lower(), text)


@dataclass(frozen=True, slots=True)
class Choice(Reader):
    """One of several words, converted by `parse`."""

    words: Sequence[str]
    parse: Callable[[str], object] = str

    def read(self, value: object, folder: Path) -> object:
        """Read a word."""
        if not isinstance(value, str) or value not in self.words:
            raise _wrong(value, " or ".join(f'"{word}"' for word in self.words))
        return self.parse(value)


@dataclass(frozen=True, slots=True)
class Several(Reader):
    """A list, each entry read by `parse(entry, folder)`."""

    wanted: str
    parse: Callable[[object, Path], object]
    may_be_empty: bool = True

    def read(self, value: object, folder: Path) -> object:
        """Read a list."""
        if not isinstance(value, list):
            raise _wrong(value, f"a list in brackets, {self.wanted}")
        if not value and not self.may_be_empty:
            raise Unfit(f"is empty: write {self.wanted}, or omit it")
        return tuple(self.parse(entry, folder) for entry in value)

    def from_text(self, text: str) -> object:
        """Take its words."""
        return text.split()


@dataclass(frozen=True, slots=True)
class Table(Reader):
    """A table of one line, {name = value}."""

    wanted: str
    parse: Callable[[object], object]

    def read(self, value: object, folder: Path) -> object:
        """Read a table."""
        if not isinstance(value, dict):
            raise _wrong(value, f"a table, {self.wanted}")
        return self.parse(value)

    def from_text(self, text: str) -> object:
        """Read the table as TOML."""
        try:
            return tomllib.loads(f"table = {text}")["table"]
        except tomllib.TOMLDecodeError:
            return text
