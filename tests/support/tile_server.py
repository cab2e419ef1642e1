# SPDX-License-Identifier: GPL-3.0-or-later
"""A server of map tiles on this machine: its tiles show where a place is, by their own arithmetic."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

from tests.support.png import png

_SIDE = 256
#: South-west, south-east, north-west and north-east of the place.
QUARTERS = ((200, 0, 0), (0, 160, 0), (0, 0, 200), (220, 180, 0))
#: Status, headers and body.
Reply = tuple[int, dict[str, str], bytes]


def quarters(zoom: int, x: int, y: int, lat: float, lon: float) -> bytes:
    """A tile whose pixels have one of four colours: by whether they are south or north, west or east of a place."""
    world = _SIDE << zoom
    east_of = world * (lon / 360 + 0.5)
    south_of = world * (0.5 - math.log(math.tan(math.pi / 4 + math.radians(lat) / 2)) / (2 * math.pi))

    def row(number: int) -> bytes:
        half = 2 if y * _SIDE + number + 0.5 < south_of else 0
        west = min(max(round(east_of - x * _SIDE), 0), _SIDE)
        return bytes(QUARTERS[half]) * west + bytes(QUARTERS[half + 1]) * (_SIDE - west)

    return png([row(number) for number in range(_SIDE)])


class TileServer:
    """`reply`: that to a tile's zoom, x and y. `asked`: the tiles requested so far, and the headers of the last one."""

    def __init__(self, port: int) -> None:
        self.template = f"http://127.0.0.1:{port}/{{z}}/{{x}}/{{y}}.png"
        self.host = f"127.0.0.1:{port}"
        self.reply: Callable[[int, int, int], Reply] = lambda *_: (200, {}, plain())
        self.asked: list[tuple[int, int, int]] = []
        self.headers: dict[str, str] = {}

    def show(self, lat: float, lon: float) -> None:
        """Send tiles that show this place."""
        self.reply = lambda zoom, x, y: (200, {}, quarters(zoom, x, y, lat, lon))


def plain() -> bytes:
    return png([bytes(QUARTERS[0]) * _SIDE] * _SIDE)


@contextmanager
def tile_server() -> Iterator[TileServer]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            tile = tuple(int(part) for part in self.path.removesuffix(".png").strip("/").split("/"))
            assert len(tile) == 3
            tiles.asked.append(tile)
            tiles.headers = dict(self.headers)
            status, headers, body = tiles.reply(*tile)
            self.send_response(status)
            for name, value in ({"Content-Length": str(len(body)), "Content-Type": "image/png"} | headers).items():
                self.send_header(name, value)
            self.end_headers()
            with suppress(ConnectionError):  # not every client waits for it
                self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        server.daemon_threads = True
        tiles = TileServer(server.server_port)
        thread = Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        yield tiles
        server.shutdown()
        thread.join()
