# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon with a page, a board, and a server of map tiles."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from tests.support.benches import Starter
from tests.support.programs import Board, until
from tests.support.tile_server import TileServer, tile_server
from tests.support.web_bench import Answer, WebBench, web_daemon

#: Two tiles, with 46 in all levels from 12 to 18.
AREA = "zoom=16&x=34000&y=23000&columns=2&rows=1"


class TileBench:
    """`web`, `board` and `tiles`, the server."""

    def __init__(self, web: WebBench, board: Board, tiles: TileServer) -> None:
        self.web = web
        self.board = board
        self.tiles = tiles

    def state(self) -> dict[str, Any]:
        """The state of the map tiles."""
        state: dict[str, Any] = self.web.state()["map"]
        return state

    def post(self, path: str, query: str = "") -> Answer:
        return self.web.ask(f"/api/map{path}?{query}", "POST", Authorization=f"Bearer {self.web.token}")

    def switch(self, *, on: bool) -> None:
        assert self.post("", f"on={int(on)}").status == 200

    def keep(self, area: str) -> dict[str, Any]:
        """Keep an area; the result."""
        assert self.post("/keep", area).status == 202
        return self.ended()

    def ended(self) -> dict[str, Any]:
        """The state of the keeping when it has ended."""
        until(lambda: not self.state()["keeping"]["running"], "the end of the keeping")
        keeping: dict[str, Any] = self.state()["keeping"]
        return keeping


@contextmanager
def tile_bench(directory: Path) -> Iterator[TileBench]:
    with ExitStack() as stack, tile_server() as tiles:
        start = Starter(directory, stack)
        board = start.board()
        web = web_daemon(start, str(board.link), f'map_tiles = "{tiles.template}"\n')
        yield TileBench(WebBench(web.daemon, board, web.port), board, tiles)
