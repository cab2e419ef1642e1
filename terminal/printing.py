# SPDX-License-Identifier: GPL-3.0-or-later
"""The output of commands: tables without trailing blanks, progress bars, and strict JSON."""

import re
from typing import TYPE_CHECKING

import click

from payloads.mission_data import to_json

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress
    from rich.table import Table

#: Columns, for measuring a table.
_WIDEST = 1000
_BLANK_END = re.compile(r"(?: |\x1b\[[\d;]*m)+$", re.MULTILINE)


def console(*, to_error: bool = False) -> "Console":
    """The terminal, which takes texts as they are: markup in the name of a setting or a vehicle is printed."""
    from rich.console import Console

    return Console(stderr=to_error, highlight=False, markup=False, emoji=False)


def progress_bars(on: "Console") -> "Progress":
    """Progress bars with the number of finished parts, drawn only on a terminal and removed at the end."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn())
    return Progress(*columns, console=on, transient=True, disable=not on.is_terminal)


def print_table(table: "Table") -> None:
    """Print a table without trailing blanks, at least as wide as the values: a shortened number would be wrong."""
    from rich.measure import Measurement

    on = console()
    on.width = max(on.width, Measurement.get(on, on.options.update(width=_WIDEST), table).minimum)
    with on.capture() as capture:
        on.print(table)
    click.echo(_BLANK_END.sub(lambda end: end[0].replace(" ", ""), capture.get()), nl=False)


def print_json(value: object) -> None:
    click.echo(to_json(value))
