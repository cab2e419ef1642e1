# SPDX-License-Identifier: GPL-3.0-or-later
"""A file with the content of a simulated board's flash or EEPROM."""

import mmap
from pathlib import Path

import click


def open_memory(path: Path, blank: bytes, hint: str) -> memoryview:
    """Map the file. A new file is `blank`. click.ClickException, with a hint if the file belongs to another board."""
    try:
        if not path.exists():
            path.write_bytes(blank)
        with path.open("r+b") as file:
            found = path.stat().st_size
            if found == len(blank):
                return memoryview(mmap.mmap(file.fileno(), found))
    except OSError as error:
        raise click.ClickException(f"the state file {path} cannot be used: {error.strerror}") from error
    raise click.ClickException(f"the state file {path} has {found} bytes, but this board's memory {len(blank)}: {hint}")
