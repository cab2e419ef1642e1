# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference page of the command line, docs/cli.md: the --help text of each command (`make cli-page`)."""

import sys
import textwrap
from collections.abc import Iterator

import click

from service.cli.main import main

EXIT_CODES = ", ".join(
    (
        "0 done",
        "1 refused or failed",
        "2 wrong usage or an unreadable file",
        "74 the output cannot be written",
        "130 interrupted.",
    )
)
_WIDTH = 100
_HEAD = f"""\
# The command line

{textwrap.fill(f"The `--help` text of every command. Common exit codes: {EXIT_CODES}", _WIDTH)}
"""


def page() -> str:
    return _HEAD + "".join(f"\n## {name}\n\n```\n{text}\n```\n" for name, text in helps(main))


def helps(
    command: click.Command, name: str = "naze-bridge", parent: click.Context | None = None
) -> Iterator[tuple[str, str]]:
    """Yield each command's full name with its --help text."""
    short = name.split()[-1]
    widths = {"terminal_width": _WIDTH, "max_content_width": _WIDTH}
    context = click.Context(command, parent=parent, info_name=short, **{**command.context_settings, **widths})
    yield name, command.get_help(context)
    if isinstance(command, click.Group):
        for each in command.list_commands(context):
            inner = command.get_command(context, each)
            if inner is not None:
                yield from helps(inner, f"{name} {each}", context)


if __name__ == "__main__":
    sys.stdout.write(page())
