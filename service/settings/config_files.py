# SPDX-License-Identifier: GPL-3.0-or-later
"""The configuration files of one folder: the status page's, setup's answers, the main file. Later files win."""

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.settings.key import Problem, short
from service.settings.table import KEYS, TABLES
from storage.os_error import reason
from storage.small_files import read_bounded

#: The answers to `naze-bridge setup`: first, so that everything written by hand overrides them.
SETUP_FILE = "setup.toml"
#: Settings made on the status page: before setup's, so that a page cannot override an answer given on the Pi.
PAGE_FILE = "page.toml"
_MAX_BYTES = 1 << 20
_NAMES = frozenset(key.name for key in KEYS)
#: A line with a table's header, or a key and the beginning of the value.
_NAMING = re.compile(r"\s*(?:\[\s*(?P<table>[\w.-]+)\s*\]|(?P<key>[\w.-]+)\s*=)")

Keys = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Given:
    """A value with the source, and the folder for relative file names in it."""

    value: object
    where: str
    folder: Path = Path()


def read_files(config: Path, problems: list[Problem], page: str | None = None) -> dict[str, Given]:
    """Read a configuration file and those in its folder: values by key name, and True for each table present.

    `page`: a draft of the status page's file, which is not read then.
    """
    page_file, setup_file = config.with_name(PAGE_FILE), config.with_name(SETUP_FILE)
    found: dict[str, Given] = {}
    if page is not None or page_file.exists():
        found |= _read_file(page_file, problems, page)
    if setup_file.exists():
        found |= _read_file(setup_file, problems)
    return found | _read_file(config, problems)


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint for an unknown name: the nearest known one, or all."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean {near[0]!r}?" if near else f"there are {', '.join(sorted(known))}"


def _read_file(path: Path, problems: list[Problem], text: str | None = None) -> dict[str, Given]:
    try:
        if text is None:
            text = read_bounded(path, _MAX_BYTES).decode("utf-8-sig")
        tables = tomllib.loads(text)
    except OSError as error:
        problems.append(Problem(str(path), f"this cannot be read: {reason(error)}"))
        return {}
    except UnicodeDecodeError:
        problems.append(Problem(str(path), "this is not UTF-8 text: save it with that encoding"))
        return {}
    except (ValueError, RecursionError) as error:
        problems.append(Problem(str(path), f"this is not valid TOML (text needs quotes, a list brackets): {error}"))
        return {}
    lines = key_lines(text)
    found: dict[str, Given] = {}
    for keys, value in _flat(tables):
        # A quoted dot belongs to the name, which settings do not have.
        name = ".".join(f'"{key}"' if "." in key else key for key in keys)
        line = lines.get(keys, lines.get(keys[:1]))
        where = str(path) if line is None else f"{path}:{line}"
        if name in _NAMES or (name in TABLES and isinstance(value, dict)):
            found[name] = Given(True if name in TABLES else value, where, path.parent)
        elif name in TABLES:
            problems.append(Problem(where, f"{name} must be a table: begin it with [{name}]"))
        else:
            problems.append(Problem(where, f"{short(name)} is not a setting; {nearest(name, (*_NAMES, *TABLES))}"))
    return found


def _flat(tables: Mapping[str, Any]) -> Iterable[tuple[tuple[str, ...], Any]]:
    for name, value in tables.items():
        yield (name,), value
        if name in TABLES and isinstance(value, dict):
            for key, inner in value.items():
                yield (name, key), inner


def key_lines(text: str) -> Mapping[Keys, int]:
    """The line, from 1, that first names each table and each key of a table, for messages.

    The parser of the standard library does not provide them.
    """
    found: dict[Keys, int] = {}
    table: Keys = ()
    for number, line in enumerate(text.split("\n"), 1):
        if (match := _NAMING.match(line)) is None:
            continue
        names = tuple((match["table"] or match["key"]).split("."))
        if match["table"]:
            table = names
        else:
            names = table + names
        # [zenoh.transport] also names zenoh.
        found.setdefault(names[:1], number)
        found.setdefault(names, number)
    return found
