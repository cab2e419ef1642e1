# SPDX-License-Identifier: GPL-3.0-or-later
"""A script of sticks and switches: `SECONDS NAME VALUE` in each line, and comments after a #."""

from pathlib import Path

import click


def read_script(path: Path) -> tuple[tuple[float, str], ...]:
    """Times after the boot, and control lines. click.ClickException."""
    found = []
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise click.ClickException(f"{path} cannot be read: {error}") from error
    for number, line in enumerate(lines, 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        try:
            at_s, name, value = float(words[0]), words[1], float(words[2])
        except (ValueError, IndexError) as error:
            raise click.ClickException(
                f"{path}, line {number}: {line.strip()!r} is not SECONDS NAME VALUE, for instance: 5 aux2 2000"
            ) from error
        found.append((at_s, f"{name} {value:g}"))
    return tuple(found)
