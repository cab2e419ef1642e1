# SPDX-License-Identifier: GPL-3.0-or-later
"""A part of the map in tiles of one zoom level, and the same in coarser and finer ones (Web Mercator, 256 pixels)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

#: Tiles by zoom, x and y.
Place = tuple[int, int, int]
FINEST_SHOWN = 19
#: 0.4 m per pixel at 48 degrees: trees and paths can be distinguished. Each finer level has four times the tiles.
_FINEST_KEPT = 18
#: A view that was enlarged stays visible when it shrinks again.
_COARSER = 4


class TileAreaError(ValueError):
    """Numbers that are not a part of the map."""


@dataclass(frozen=True, slots=True)
class TileArea:
    """`columns` by `rows` tiles from (`x`, `y`) on; the columns may cross the date line."""

    zoom: int
    x: int
    y: int
    columns: int
    rows: int

    def __post_init__(self) -> None:
        side = 1 << min(self.zoom, FINEST_SHOWN)
        is_within = self.zoom <= FINEST_SHOWN and self.x < side and self.y + self.rows <= side
        if not is_within or not 0 < self.columns <= side or self.rows < 1:
            raise TileAreaError("These tiles are not on the map.")

    @classmethod
    def from_query(cls, query: Mapping[str, str]) -> "TileArea":
        """Read the numbers of a request; TileAreaError."""
        names = ("zoom", "x", "y", "columns", "rows")
        texts = [query.get(name, "") for name in names]
        if not all(text.isascii() and text.isdecimal() and len(text) <= len(str(1 << FINEST_SHOWN)) for text in texts):
            raise TileAreaError(f"An area has the whole numbers {', '.join(names)}.")
        return cls(*map(int, texts))

    @property
    def count(self) -> int:
        return self.columns * self.rows

    def tiles(self) -> Iterator[Place]:
        for row in range(self.y, self.y + self.rows):
            for column in range(self.x, self.x + self.columns):
                yield self.zoom, column % (1 << self.zoom), row

    def levels(self) -> "list[TileArea]":
        """The same area from a few coarser levels to the finest one that is kept."""
        coarsest = max(self.zoom - _COARSER, 0)
        return [self._at(zoom) for zoom in range(coarsest, max(self.zoom, _FINEST_KEPT) + 1)]

    def _at(self, zoom: int) -> "TileArea":
        if zoom >= self.zoom:
            finer = zoom - self.zoom
            return TileArea(zoom, self.x << finer, self.y << finer, self.columns << finer, self.rows << finer)
        coarser = self.zoom - zoom
        x, y = self.x >> coarser, self.y >> coarser
        columns = ((self.x + self.columns - 1) >> coarser) - x + 1
        rows = ((self.y + self.rows - 1) >> coarser) - y + 1
        return TileArea(zoom, x, y, min(columns, 1 << zoom), rows)
