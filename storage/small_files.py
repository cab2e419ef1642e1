# SPDX-License-Identifier: GPL-3.0-or-later
"""Small files: read up to a maximum size, and written atomically, even if the power is cut."""

import os
import stat
from pathlib import Path
from typing import BinaryIO


def read_bounded(path: Path, most: int) -> bytes:
    """The contents; OSError if the file cannot be read, or is larger than `most` bytes (as /dev/zero is)."""
    with path.open("rb") as file:
        return _bounded(file, most)


def read_untrusted(path: Path, most: int) -> bytes:
    """Like read_bounded, for root in a folder that another user controls: OSError also for a link, pipe or device."""
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


def replace_file(path: Path, data: bytes, mode: int = 0o600) -> None:
    """Replace the file's content with `data`; on OSError the old content is kept."""
    draft = path.with_name(f"{path.name}.new")
    # Not through a link: a root daemon may have been given a folder that another user can write to.
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o600)
    with open(descriptor, "wb") as file:
        os.fchmod(descriptor, mode)
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    draft.replace(path)
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
