# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of the command line, docs/cli.md: each command's help text and options (`make cli-page`)."""

import sys
from collections.abc import Iterator

import click

from service.cli.main import main

_WIDTH = 100
_HEAD = """\
# The command line

`--help` after a command, or `man naze-bridge`, explains the options.
"""


def page() -> str:
    return _HEAD + "".join(_section(name, context) for name, context in _commands(main))


def helps(command: click.Command) -> Iterator[tuple[str, str]]:
    """Yield each command's full name with its --help text."""
    for name, context in _commands(command):
        yield name, context.command.get_help(context)


def _commands(
    command: click.Command, name: str = "naze-bridge", parent: click.Context | None = None
) -> Iterator[tuple[str, click.Context]]:
    short = name.split()[-1]
    widths = {"terminal_width": _WIDTH, "max_content_width": _WIDTH}
    context = click.Context(command, parent=parent, info_name=short, **{**command.context_settings, **widths})
    yield name, context
    if isinstance(command, click.Group):
        for each in command.list_commands(context):
            inner = command.get_command(context, each)
            if inner is not None:
                yield from _commands(inner, f"{name} {each}", context)


def _section(name: str, context: click.Context) -> str:
    formatter = context.make_formatter()
    context.command.format_help_text(context, formatter)
    options = (each for each in context.command.get_params(context) if isinstance(each, click.Option))
    named = [option.opts[-1] for option in options if not option.hidden and "--help" not in option.opts]
    if named:
        formatter.write_paragraph()
        formatter.write_text(f"Options: {', '.join(named)}.")
    arguments = context.command.collect_usage_pieces(context)[1:]  # the first is [OPTIONS]
    text = formatter.getvalue().strip("\n")
    return f"\n## {' '.join([name, *arguments])}\n\n```\n{text}\n```\n"


if __name__ == "__main__":
    sys.stdout.write(page())
