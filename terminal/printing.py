# SPDX-License-Identifier: GPL-3.0-or-later
"""The output of commands: tables without trailing blanks, progress bars, and strict JSON."""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from payloads.mission_data import to_json

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.progress import Progress
    from rich.table import Table

#: Columns, for measuring a table.
_WIDEST = 1000
_BLANK_END = re.compile(r"(?: |\x1b\[[\d;]*m)+$", re.MULTILINE)


def console(*, to_error: bool = False) -> "Console":
    """The terminal, which takes texts as they are: markup in the name of a setting or a vehicle has no effect."""
    from rich.console import Console

    return Console(stderr=to_error, highlight=False, markup=False, emoji=False)


def progress_bars(on: "Console") -> "Progress":
    """Progress bars with the number of finished parts, drawn only on a terminal and removed at the end."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn())
    return Progress(*columns, console=on, transient=True, disable=not on.is_terminal)


def print_table(table: "Table") -> None:
    """Print a table as wide as the terminal, or 80 columns in a file, without trailing blanks.

    On a terminal that is too narrow each row becomes a paragraph: a shortened number would be a wrong one, and wrapped
    lines could not be read as columns.
    """
    from rich.console import Group
    from rich.measure import Measurement

    on = console()
    needed = Measurement.get(on, on.options.update(width=_WIDEST), table).minimum
    shown = table if needed <= on.width else Group(*_paragraphs(table), table.caption or "")
    with on.capture() as capture:
        on.print(shown)
    click.echo(_BLANK_END.sub(lambda end: end[0].replace(" ", ""), capture.get()), nl=False)


def _paragraphs(table: "Table") -> Iterator["RenderableType"]:
    """Each row with the titles of its cells: the first two alone, then the others, without empty ones."""
    from rich.padding import Padding
    from rich.text import Text

    titles = [str(column.header) for column in table.columns]
    for row, *cells in zip(table.rows, *(column.cells for column in table.columns), strict=True):
        texts = [cell if isinstance(cell, Text) else Text(str(cell)) for cell in cells]
        yield Text.assemble(f"{titles[0]} ", texts[0], " ", *texts[1:2], style=row.style or "")
        named = [
            Text.assemble(f"{title}=", *text.split("\n"))
            for title, text in zip(titles[2:], texts[2:], strict=True)
            if text.plain.strip() not in ("", "-")
        ]
        yield Padding(Text(", ", style=row.style or "").join(named), (0, 0, 0, 2))


def print_json(value: object) -> None:
    click.echo(to_json(value))
