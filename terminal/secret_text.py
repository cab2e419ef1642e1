# SPDX-License-Identifier: GPL-3.0-or-later
"""Secrets for the person at the terminal. Captured output, such as a log, gets the place of the secret instead."""

import sys

import click


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
