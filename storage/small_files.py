# SPDX-License-Identifier: GPL-3.0-or-later
"""Small files: read up to a maximum size, and written atomically, even if the power is cut."""

import os
import stat
from pathlib import Path
from typing import BinaryIO

_NONBLOCK: int = getattr(os, "O_NONBLOCK", 0)  # Windows, where `naze-bridge card` runs too, has none


def read_bounded(path: Path, most: int, *, follows_links: bool = True) -> bytes:
    """The contents. Raises OSError if the file cannot be read, is larger than `most` bytes, or is a pipe or a device.

    Those might never end, or never begin. follows_links: False for root in a folder that another user controls.
    """
    with open_regular(path, follows_links=follows_links) as file:
        data = file.read(most + 1)
    if len(data) > most:
        size = f"{most >> 20} MB" if most >> 20 else f"{most >> 10} kB"
        raise OSError(f"it is larger than {size}")
    return data


def open_regular(path: Path, *, follows_links: bool = True) -> BinaryIO:
    """Open a file to read. OSError also if it is a pipe or a device. Never waits for the other end of a pipe."""
    flags = _NONBLOCK if follows_links else _NONBLOCK | os.O_NOFOLLOW
    file = open(path, "rb", opener=lambda name, others: os.open(name, others | flags))  # noqa: SIM115  # the caller's
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise OSError("it is not a regular file")
    return file


def replace_file(path: Path, data: bytes, mode: int = 0o600) -> None:
    """Replace the file's content with `data`. On OSError the old content is kept."""
    draft = path.with_name(f"{path.name}.new")
    # Not through a link: a root daemon may have been given a folder that another user can write to.
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o600)
    try:
        with open(descriptor, "wb") as file:
            os.fchmod(descriptor, mode)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    except OSError:
        draft.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
