# SPDX-License-Identifier: GPL-3.0-or-later
"""The tiles kept on the Pi, as the page reads them and as the program that fetches them writes them."""

import hashlib
import os
import shutil
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from payloads.mission_data import Json
from service.machine.threads import BackgroundThread
from service.settings.web import TileSource
from service.web.tile_area import Place
from storage.small_files import read_bounded

#: Levels: a tile that is any coarser is only a blur.
_COARSER = 5
#: The page itself waits for 8 s.
_TIMEOUT_S = 5.0
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


class TileStore:
    """The tiles of one source. `folder`: of all sources. Every method may raise OSError, even for a hanging disk."""

    def __init__(self, folder: Path, source: TileSource) -> None:
        self.folder = folder
        self._own = folder / hashlib.sha256(str(source).encode()).hexdigest()[:16]
        self._disk = BackgroundThread("map", _TIMEOUT_S)

    def close(self) -> None:
        self._disk.close(0)

    def file(self, place: Place) -> Path:
        zoom, x, y = place
        return self._own / str(zoom) / str(x) / str(y)

    async def read(self, place: Place) -> tuple[bytes, str]:
        """A tile and its media type; FileNotFoundError if it is not kept, or damaged."""
        return await self._disk.ask(partial(self._read, place))

    async def kept(self, places: Iterable[Place]) -> Json:
        """For each tile that can be drawn: x, y, and the zoom of the tile to draw it from, its own or a coarser one."""
        return await self._disk.ask(partial(self._kept, places))

    def forget(self) -> None:
        """Delete the tiles of all sources, after the reply: there may be thousands."""
        self._disk.submit(partial(shutil.rmtree, self.folder, ignore_errors=True))

    def _read(self, place: Place) -> tuple[bytes, str]:
        data = read_bounded(self.file(place), MAX_TILE)
        kind = image_type(data)
        if kind is None:  # a power cut
            raise FileNotFoundError
        return data, kind

    def _kept(self, places: Iterable[Place]) -> Json:
        known: dict[Place, bool] = {}

        def is_kept(place: Place) -> bool:
            if place not in known:
                known[place] = self.file(place).exists()
            return known[place]

        found = []
        for zoom, x, y in places:
            levels = range(min(_COARSER, zoom) + 1)
            coarser = next((each for each in levels if is_kept((zoom - each, x >> each, y >> each))), None)
            if coarser is not None:
                found.append([x, y, zoom - coarser])
        return {"kept": found}
