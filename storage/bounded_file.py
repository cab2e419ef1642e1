# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads files written by others, up to a maximum size."""

import os
import stat
from pathlib import Path
from typing import BinaryIO


def read_bounded(path: Path, most: int) -> bytes:
    """The contents; OSError if the file cannot be read, or is larger than `most` bytes (as /dev/zero is)."""
    with path.open("rb") as file:
        return _bounded(file, most)


def read_untrusted(path: Path, most: int) -> bytes:
    """The same for root, in a folder that another user controls: OSError for a link, a pipe or a device, too."""
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NOFOLLOW | os.O_NONBLOCK)) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError("it is not a regular file")
        return _bounded(file, most)


def _bounded(file: BinaryIO, most: int) -> bytes:
    data = file.read(most + 1)
    if len(data) > most:
        size = f"{most >> 20} MB" if most >> 20 else f"{most >> 10} kB"
        raise OSError(f"it is larger than {size}")
    return data
