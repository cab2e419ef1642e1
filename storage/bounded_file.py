# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads user-supplied files, up to a maximum size."""

from pathlib import Path


def read_bounded(path: Path, most: int) -> bytes:
    """The contents; OSError if the file cannot be read, or is larger than `most` bytes (as /dev/zero is)."""
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        size = f"{most >> 20} MB" if most >> 20 else f"{most >> 10} kB"
        raise OSError(f"it is larger than {size}")
    return data
