# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of map tiles: bounded in number of bytes, and marked with the time at which each tile expires."""

import os
from pathlib import Path

MAX_TILE = 1 << 20


class CacheFullError(Exception):
    """There is no room for another tile; one sentence."""


def image_type(data: bytes) -> str | None:
    """The media type of a tile's image; None if it is none."""
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return "image/png"
    if data.startswith(b"\xff\xd8\xff"):
        return "image/jpeg"
    return "image/webp" if data.startswith(b"RIFF") and data[8:12] == b"WEBP" else None


class TileCache:
    """The files of a folder. A file's modification time is the time at which its tile expires.

    `most_bytes`: of all files; for new ones those that expire first are deleted, but none of `wanted`.
    """

    def __init__(self, folder: Path, most_bytes: int, wanted: set[Path]) -> None:
        self._most_bytes = most_bytes
        files = [(path, path.stat()) for path in folder.rglob("*") if path.is_file()]
        self.tiles, self.bytes = len(files), sum(status.st_size for _, status in files)
        files.sort(key=lambda file: file[1].st_mtime)
        self._spare = iter([(path, status.st_size) for path, status in files if path not in wanted])

    def is_fresh(self, path: Path, now: float) -> bool:
        return path.exists() and path.stat().st_mtime > now

    def keep(self, path: Path, data: bytes, expires: float) -> None:
        """Write a file; CacheFullError."""
        before = path.stat().st_size if path.exists() else None
        added = len(data) - (before or 0)
        while self.bytes + added > self._most_bytes:
            self._delete_one()
        path.parent.mkdir(parents=True, exist_ok=True)
        new = path.with_suffix(".new")
        new.write_bytes(data)
        os.utime(new, (expires, expires))
        new.replace(path)
        self.tiles += before is None
        self.bytes += added

    def _delete_one(self) -> None:
        path, size = next(self._spare, (None, 0))
        if path is None:
            raise CacheFullError(f"The {self._most_bytes >> 20} MB for map tiles are full.")
        path.unlink()
        self.tiles -= 1
        self.bytes -= size
