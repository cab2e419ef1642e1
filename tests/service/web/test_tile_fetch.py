# SPDX-License-Identifier: GPL-3.0-or-later
"""Fetching tiles from a server that is good, slow, broken, or not one of tiles."""

import json
import time
from collections.abc import Iterator
from email.message import Message
from email.utils import formatdate
from pathlib import Path
from typing import Any

import pytest

from service.web import tile_fetch
from service.web.tile_fetch import FetchRequest, TileFetch, lifetime_s
from service.web.tile_store import MAX_TILE
from tests.support.tile_server import TileServer, plain, tile_server


@pytest.fixture
def tiles() -> Iterator[TileServer]:
    with tile_server() as server:
        yield server


class Fetch:
    """Runs requests for the tiles of zoom 1 and 2, and returns the last report; `reports` has all."""

    def __init__(self, folder: Path, capture: pytest.CaptureFixture[str]) -> None:
        self.folder = folder
        self.reports: list[dict[str, Any]] = []
        self._capture = capture

    def run(self, tiles: TileServer, most_bytes: int = 1 << 20) -> dict[str, Any]:
        levels = [
            [(f"/{zoom}/{x}/{y}.png", str(self.folder / f"{zoom}-{x}-{y}")) for x in range(2) for y in range(2)]
            for zoom in (1, 2)
        ]
        TileFetch(FetchRequest(f"http://{tiles.host}", "naze-bridge/test", str(self.folder), most_bytes, levels)).run()
        self.reports = [json.loads(line) for line in self._capture.readouterr().out.splitlines()]
        return self.reports[-1]


@pytest.fixture
def fetch(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Fetch:
    return Fetch(tmp_path, capsys)


def test_tiles_are_kept_and_not_fetched_again(tiles: TileServer, fetch: Fetch) -> None:
    report = fetch.run(tiles)
    assert report == {"total": 8, "done": 8, "absent": 0, "tiles": 8, "bytes": 8 * len(plain()), "end": ""}
    assert tiles.headers["User-Agent"] == "naze-bridge/test"
    assert (fetch.folder / "1-0-1").read_bytes() == plain()
    fetch.run(tiles)
    assert len(tiles.asked) == 8


def test_progress_is_reported_while_tiles_arrive(
    tiles: TileServer, fetch: Fetch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tile_fetch, "_REPORT_S", 0)
    fetch.run(tiles)
    assert [(report["done"], report["end"]) for report in fetch.reports] == [
        *((number, None) for number in range(1, 9)),
        (8, ""),
    ]


def test_an_expired_tile_is_fetched_again(tiles: TileServer, fetch: Fetch) -> None:
    tiles.reply = lambda zoom, *_: (200, {"Cache-Control": "max-age=0" if zoom == 2 else "max-age=1000"}, plain())
    fetch.run(tiles)
    tiles.asked.clear()
    fetch.run(tiles)
    assert {zoom for zoom, *_ in tiles.asked} == {2}


def test_tiles_that_do_not_exist_are_counted_and_finer_levels_are_not_requested(
    tiles: TileServer, fetch: Fetch
) -> None:
    tiles.reply = lambda zoom, x, _: (200, {}, plain()) if zoom == 1 and x == 0 else (404, {}, b"no")
    report = fetch.run(tiles)
    assert (report["end"], report["absent"], report["tiles"]) == ("", 6, 2)
    tiles.asked.clear()
    tiles.reply = lambda *_: (404, {}, b"no")
    for kept in fetch.folder.iterdir():
        kept.unlink()
    report = fetch.run(tiles)
    assert (report["total"], len(tiles.asked)) == (4, 4)


@pytest.mark.parametrize(
    ("status", "headers", "body", "why"),
    [
        (403, {}, b"blocked", "refuses /1/0/"),
        (302, {"Location": "http://example.com/"}, b"", "302"),
        (500, {}, b"", "500"),
        (200, {}, b"<!doctype html>sign in to this Wi-Fi", "neither PNG, JPEG nor WebP"),
        (200, {}, plain() + bytes(MAX_TILE), "more than 1 MB"),
        (200, {"Content-Length": "100000", "Connection": "close"}, plain(), "does not answer: the tile was cut off"),
    ],
)
def test_a_server_that_sends_no_tiles_ends_the_request(
    tiles: TileServer, fetch: Fetch, status: int, headers: dict[str, str], body: bytes, why: str
) -> None:
    tiles.reply = lambda *_: (status, headers, body)
    report = fetch.run(tiles)
    assert tiles.host in report["end"]
    assert why in report["end"]
    assert not [*fetch.folder.iterdir()]
    assert {zoom for zoom, *_ in tiles.asked} == {1}
    tiles.reply = lambda *_: (200, {}, plain())
    assert fetch.run(tiles)["end"] == ""


def test_a_silent_server_is_not_waited_for(tiles: TileServer, fetch: Fetch, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tile_fetch, "_TIMEOUT_S", 0.1)
    tiles.pause_s = 2
    assert "takes more than" in fetch.run(tiles)["end"]


def test_a_missing_server_is_named(tiles: TileServer, fetch: Fetch) -> None:
    tiles.host = "127.0.0.1:1"
    assert fetch.run(tiles)["end"] == "127.0.0.1:1 does not answer: Connection refused."


def test_a_full_cache_ends_the_request(tiles: TileServer, fetch: Fetch) -> None:
    assert "are full" in fetch.run(tiles, most_bytes=3 * len(plain()))["end"]


@pytest.mark.parametrize(
    ("headers", "expected_s"),
    [
        ({"Cache-Control": "public, max-age=600"}, 600),
        ({"Cache-Control": "Max-Age=600", "Expires": formatdate(0)}, 600),
        ({"Expires": "0"}, 7 * 86400),
        ({}, 7 * 86400),
    ],
)
def test_the_source_says_how_long_a_tile_may_be_kept(headers: dict[str, str], expected_s: int) -> None:
    assert lifetime_s(message(headers)) == expected_s


def test_a_tile_may_be_kept_until_the_date_that_the_source_names() -> None:
    before_s = time.time()
    lifetime = lifetime_s(message({"Expires": formatdate(before_s + 3600)}))
    # Dates have whole seconds.
    assert 3599 - (time.time() - before_s) <= lifetime <= 3600


def message(headers: dict[str, str]) -> Message:
    received = Message()
    for name, value in headers.items():
        received[name] = value
    return received
