# SPDX-License-Identifier: GPL-3.0-or-later
"""The output of commands: tables without trailing blanks, and strict JSON."""

import re
from typing import TYPE_CHECKING

import click

from payloads.mission_data import to_json

if TYPE_CHECKING:
    from rich.console import RenderableType

#: Columns, for measuring a table.
_WIDEST = 1000
_BLANK_END = re.compile(r"(?: |\x1b\[[\d;]*m)+$", re.MULTILINE)


def print_table(table: "RenderableType") -> None:
    """Print a table as wide as the terminal, or 80 columns in a file, without trailing blanks.

    On a terminal that is too narrow its lines wrap: a shortened number would be a wrong one.
    """
    from rich.console import Console
    from rich.measure import Measurement

    console = Console(highlight=False)
    needed = Measurement.get(console, console.options.update(width=_WIDEST), table).minimum
    console.width = max(console.width, needed)
    with console.capture() as capture:
        console.print(table)
    click.echo(_BLANK_END.sub(lambda end: end[0].replace(" ", ""), capture.get()), nl=False)


def print_json(value: object) -> None:
    click.echo(to_json(value))
