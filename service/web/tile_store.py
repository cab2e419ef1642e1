# SPDX-License-Identifier: GPL-3.0-or-later
"""The tiles kept on the Pi, as the page reads them. Every method may raise OSError, also if the disk hangs."""

import hashlib
import shutil
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from payloads.mission_data import Json
from service.machine.threads import BackgroundThread
from service.settings.tile_source import TileSource
from service.web.tile_area import Place
from service.web.tile_cache import MAX_TILE, image_type
from storage.bounded_file import read_bounded

#: A tile of so much coarser a level is only a blur.
_COARSER = 5
#: The page itself waits for 8 s.
_TIMEOUT_S = 5.0


class TileStore:
    """The tiles of one source. `folder`: of all sources."""

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
