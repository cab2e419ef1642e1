# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of commands, which suggest the nearest name and import a command only when it is used; types of arguments."""

import difflib
import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import click
from click.shell_completion import CompletionItem

from protocols.mission_item import degrees_to_e7, is_on_earth

#: Not click's own check for read access: the commands' messages give a remedy.
PATH = click.Path(path_type=Path, readable=False)


class CommandGroup(click.Group):
    """A group that answers a misspelt command with the nearest one."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command. Raises UsageError with a suggestion if there is none of that name."""
        name, known = args[0], self.list_commands(ctx)
        if name not in known and not name.startswith("-"):
            near = difflib.get_close_matches(name.lower(), known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}"
            ctx.fail(f"{name!r} is not a command: {hint}")
        return super().resolve_command(ctx, args)


class LazyCommand(NamedTuple):
    """The location of a command, as "module:name", and the line in the list of commands."""

    source: str
    summary: str


class LazyGroup(CommandGroup):
    """A group given by a table, so that listing and completing commands does not import them."""

    def __init__(self, *args: Any, commands: Mapping[str, LazyCommand], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._table = commands

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self._table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self._table:
            return None
        module, _, name = self._table[cmd_name].source.partition(":")
        command: click.Command = getattr(importlib.import_module(module), name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.summary) for name, command in self._table.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        named = [
            CompletionItem(name, help=command.summary)
            for name, command in self._table.items()
            if name.startswith(incomplete)
        ]
        return named + click.Command.shell_complete(self, ctx, incomplete)


def position(_ctx: click.Context, _param: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Read LAT,LON in degrees as (lat_e7, lon_e7); a click callback."""
    if text is None:
        return None
    try:
        lat, lon = (degrees_to_e7(float(each)) for each in text.split(","))
    except ValueError:
        lat = lon = None
    if lat is None or lon is None or not is_on_earth(lat, lon):
        raise click.BadParameter(f"{text!r} is not a position: write it like 45.3838,8.4733")
    return lat, lon
