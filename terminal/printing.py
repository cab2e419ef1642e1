# SPDX-License-Identifier: GPL-3.0-or-later
"""The output of commands: tables without trailing blanks, and strict JSON."""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from payloads.mission_data import to_json

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

#: Columns, for measuring a table.
_WIDEST = 1000
_BLANK_END = re.compile(r"(?: |\x1b\[[\d;]*m)+$", re.MULTILINE)


def print_table(table: "Table") -> None:
    """Print a table as wide as the terminal, or 80 columns in a file, without trailing blanks.

    On a terminal that is too narrow each row becomes a paragraph: a shortened number would be a wrong one, and wrapped
    lines could not be read as columns.
    """
    from rich.console import Console, Group
    from rich.measure import Measurement

    console = Console(highlight=False)
    needed = Measurement.get(console, console.options.update(width=_WIDEST), table).minimum
    shown = table if needed <= console.width else Group(*_paragraphs(table), table.caption or "")
    with console.capture() as capture:
        console.print(shown)
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
