# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference page of the command line, docs/cli.md: the --help text of each command (`make cli-page`)."""

import sys
from collections import Counter
from collections.abc import Iterator, Sequence

import click

from service.cli.main import main

_WIDTH = 100
_HEAD = """\
# The command line

From the `--help` text of every command.
"""
#: An option of at least this many commands is explained once.
_COMMON = 4
Option = tuple[str, str]


def page() -> str:
    commands = list(_commands(main))
    uses = Counter(option for _, context in commands for option in _options(context))
    common = [option for option, count in uses.items() if count >= _COMMON]
    parts = [_HEAD]
    for name, context in commands:
        options = _options(context)
        own = [option for option in options if option not in common]
        shared = [_short(option) for option in options if option in common]
        parts.append(_section(name, context, own, shared))
        if context.parent is None:
            parts.append(_block("Common options", _listed(common)))
    return "".join(parts)


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


def _options(context: click.Context) -> list[Option]:
    options = (each for each in context.command.get_params(context) if isinstance(each, click.Option))
    records = (option.get_help_record(context) for option in options)
    return [record for record in records if record is not None]


def _short(option: Option) -> str:
    """Its last name: `--help` of `-h, --help`."""
    return option[0].split(", ")[-1].split()[0]


def _listed(options: Sequence[Option]) -> str:
    formatter = click.HelpFormatter(width=_WIDTH)
    formatter.write_dl(options)
    return formatter.getvalue()


def _section(name: str, context: click.Context, own: Sequence[Option], shared: Sequence[str]) -> str:
    formatter = context.make_formatter()
    context.command.format_help_text(context, formatter)
    if own:
        with formatter.section("Options"):
            formatter.write_dl(own)
    if shared != ["--help"]:
        formatter.write_paragraph()
        formatter.write_text(f"Also {', '.join(shared[:-1])}.")
    if context.parent is None and isinstance(context.command, click.Group):
        context.command.format_commands(context, formatter)
    arguments = context.command.collect_usage_pieces(context)[1:]  # the first is [OPTIONS]
    return _block(" ".join([name, *arguments]), formatter.getvalue().lstrip("\n"))


def _block(heading: str, text: str) -> str:
    return f"\n## {heading}\n\n```\n{text.rstrip()}\n```\n"


if __name__ == "__main__":
    sys.stdout.write(page())
