# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences and secrets on the terminal: sentences are wrapped there, and whole lines in a file or pipe."""

import shutil
import sys
import textwrap
from typing import NoReturn

import click

#: The exit status after Ctrl-C, as shells have it: 128 + SIGINT.
INTERRUPTED = 130
#: The exit status if a file that was named cannot be read.
UNREADABLE = 2


def say(text: str, *, to_error: bool = False, prefix: str = "", indent: int = 0) -> None:
    """Print `text` after `prefix`, which is `indent` columns wide. Further lines are indented as much."""
    if (sys.stderr if to_error else sys.stdout).isatty():
        width = max(shutil.get_terminal_size().columns - indent, 20)
        fit = textwrap.TextWrapper(width, break_long_words=False, break_on_hyphens=False)
        text = f"\n{'':{indent}}".join(piece for line in text.splitlines() for piece in fit.wrap(line) or [""])
    click.echo(prefix + text, err=to_error)


def complain(text: object) -> None:
    """Print one sentence after the program's name to standard error."""
    say(f"naze-bridge: {text}", to_error=True)


def fail(text: object, status: int = 1) -> NoReturn:
    """End the program with one sentence and this status."""
    complain(text)
    raise SystemExit(status)


def show_secret(what: str, secret: str, kept_in: str, code: str) -> None:
    """Print a secret and the QR code of `code` to a terminal, else the name of the file that has the secret."""
    if not is_terminal():
        click.echo(f"{what}: in {kept_in}")
        return
    click.echo(f"{what}: {secret}")
    print_code(code)


def is_terminal() -> bool:
    return sys.stdout.isatty()


def print_code(text: str) -> None:
    """Print a QR code."""
    import segno  # imported here: few commands need it

    segno.make(text, error="l").terminal(compact=True)
