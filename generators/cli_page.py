# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of the command line, docs/cli.md: each command's purpose and exit codes (`make cli-page`)."""

import re
import sys
from collections.abc import Iterator

import click

from service.cli.main import main

_WIDTH = 100
_HEAD = """\
# The command line

`naze-bridge COMMAND --help`, or `man naze-bridge`, has the options, and when the exit code is 1.

"""


def page() -> str:
    lines = (_line(name, each) for name, each in _commands(main) if each.parent is None or not _is_group(each))
    return _HEAD + "".join(lines)


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


def _is_group(context: click.Context) -> bool:
    return isinstance(context.command, click.Group)


def _line(name: str, context: click.Context) -> str:
    """The command with arguments, the first paragraph of the help, and the sentences about other exit codes than 1."""
    first, *others = re.split(r"\n\s*\n", (context.command.help or "").replace("\b", ""))
    sentences = re.findall(r"Exit codes?\b.*?\.(?=\s|$)", " ".join(others), re.DOTALL)
    exits = [each for each in sentences if re.search(r"\b[023]\b", each)]
    arguments = context.command.collect_usage_pieces(context)[1:]  # the first is [OPTIONS]
    short = name.removeprefix("naze-bridge ")
    return f"- `{' '.join([short, *arguments])}`: {' '.join(' '.join([first, *exits]).split())}\n"


if __name__ == "__main__":
    sys.stdout.write(page())
