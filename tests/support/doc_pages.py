# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages of the documentation and their examples: fenced blocks, and commands and settings within the text."""

import re
import shlex
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.support.programs import REPOSITORY

#: CHANGELOG.md is not a page: it names what has been removed. docs/cli.md is compared as a whole (test_cli_page.py).
PAGES = [
    *(REPOSITORY / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "firmware/README.md")),
    *sorted(path for path in (REPOSITORY / "docs").rglob("*.md") if path.name != "cli.md"),
]
_FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_PROGRAMS = {"naze-bridge", "make", "python", "sudo", "pip", "systemctl", "journalctl"}
#: Groups of naze-bridge's commands, which pages also name without the program.
_GROUPS = {"fleet", "missions"}


class Block(NamedTuple):
    """A fenced block; `place` is its page and line."""

    place: str
    language: str
    text: str


class Command(NamedTuple):
    """A line for the shell, without `sudo` and comments; `place` is its page."""

    place: str
    words: tuple[str, ...]

    @property
    def text(self) -> str:
        return " ".join(self.words)


@cache
def text_of(page: Path) -> str:
    return page.read_text()


def place_of(page: Path) -> str:
    return str(page.relative_to(REPOSITORY))


def prose_of(page: Path) -> str:
    """The page's text without its fenced blocks."""
    return _FENCED.sub("", text_of(page))


def blocks() -> list[Block]:
    return [
        Block(f"{place_of(page)}:{_line(page, found.start())}", found[1], found[2])
        for page in PAGES
        for found in _FENCED.finditer(text_of(page))
    ]


def _line(page: Path, at: int) -> int:
    return text_of(page).count("\n", 0, at) + 1


def spans(page: Path) -> list[str]:
    """The pieces of code within the text, each in one line."""
    return [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", prose_of(page))]


def commands() -> list[Command]:
    """Each different command, at its first place."""
    first: dict[tuple[str, ...], str] = {}
    for place, line in _lines():
        for command in line.split(" && "):
            words = shlex.split(command.partition(" 2> ")[0], comments=True)
            words = words[1:] if words[:1] == ["sudo"] else words
            first.setdefault(tuple(words), place)
    return [Command(place, words) for words, place in first.items() if words]


def _lines() -> Iterator[tuple[str, str]]:
    for block in blocks():
        if block.language == "sh":
            yield from ((block.place, line) for line in block.text.splitlines())
    for page in PAGES:
        for span in spans(page):
            first, _, rest = span.partition(" ")
            if rest and first in _PROGRAMS:
                yield place_of(page), span
            elif rest and first in _GROUPS:
                yield place_of(page), f"naze-bridge {span.partition(' [')[0]}"  # without optional arguments
