# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes small files atomically, even if the power is cut."""

import os
from pathlib import Path


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
