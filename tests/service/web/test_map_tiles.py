# SPDX-License-Identifier: GPL-3.0-or-later
"""The requests about map tiles: off until they are switched on, with the token, and never an open proxy."""

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from service.web.tile_keeping import MOST_TILES
from tests.support.benches import Starter
from tests.support.programs import until
from tests.support.tile_bench import AREA, TileBench, tile_bench
from tests.support.tile_server import plain
from tests.support.web_bench import WebBench, web_daemon


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[TileBench]:
    with tile_bench(tmp_path) as bench:
        yield bench


def test_nothing_is_fetched_until_tiles_are_switched_on(bench: TileBench) -> None:
    page = bench.web.ask("/")
    assert "img-src 'self';" in page.headers["content-security-policy"]
    assert bench.post("/keep", AREA).status == 404
    assert bench.web.ask(f"/api/map/kept?{AREA}").status == 404
    assert bench.web.ask("/api/map/tiles/1/0/0").status == 404
    assert bench.tiles.asked == []


def test_the_page_may_load_pictures_from_the_source_only_while_they_are_on(bench: TileBench) -> None:
    before = bench.web.ask("/").headers
    bench.switch(on=True)
    headers = bench.web.ask("/", **{"If-None-Match": before["etag"]}).headers
    assert f"img-src 'self' http://{bench.tiles.host};" in headers["content-security-policy"]
    assert headers["content-security-policy"].count("http:") == 1
    bench.switch(on=False)
    assert bench.web.ask("/").headers["content-security-policy"] == before["content-security-policy"]


@pytest.mark.parametrize("path", ["?on=1", f"/keep?{AREA}", "/stop", "/forget"])
def test_every_change_needs_the_token(bench: TileBench, path: str) -> None:
    assert bench.web.ask(f"/api/map{path}", "POST").status == 403
    assert bench.web.ask(f"/api/map{path}", "POST", Authorization="Bearer wrong").status == 403
    assert not bench.state()["on"]


def test_an_area_is_kept_and_read_without_the_source(bench: TileBench) -> None:
    bench.switch(on=True)
    kept = bench.keep(AREA)
    assert (kept["text"], kept["total"]) == ("46 tiles of this area are kept.", len(bench.tiles.asked))
    assert {zoom for zoom, *_ in bench.tiles.asked} == {12, 13, 14, 15, 16, 17, 18}
    state = bench.state()
    assert (state["tiles"], state["bytes"]) == (46, 46 * len(plain()))
    assert sorted(bench.web.ask(f"/api/map/kept?{AREA}").data["kept"]) == [[34000, 23000, 16], [34001, 23000, 16]]
    tile = bench.web.ask("/api/map/tiles/16/34000/23000")
    assert (tile.body, tile.headers["content-type"]) == (plain(), "image/png")
    # A finer tile, which is not kept, can be drawn from a coarser one.
    finer = "zoom=19&x=272000&y=184000&columns=1&rows=1"
    assert bench.web.ask(f"/api/map/kept?{finer}").data["kept"] == [[272000, 184000, 18]]


def test_the_choice_and_the_tiles_outlast_a_restart(tmp_path: Path) -> None:
    with tile_bench(tmp_path) as bench:
        bench.switch(on=True)
        bench.keep(AREA)
    with ExitStack() as stack:
        again = web_daemon(Starter(tmp_path, stack), web=f'map_tiles = "{bench.tiles.template}"\n')
        state = again.state()["map"]
        assert (state["on"], state["tiles"]) == (True, 46)
        assert again.ask("/api/map/tiles/16/34000/23000").status == 200


def test_a_tile_is_found_only_by_three_numbers(bench: TileBench) -> None:
    bench.switch(on=True)
    for path in ("../../web-token", "1/0/..%2f..%2fweb-token", "1/0/0.png", "1/0/-1", "%2e%2e/%2e%2e/web-token"):
        answer = raw(bench.web, f"/api/map/tiles/{path}")
        assert answer.startswith(b"HTTP/1.1 404"), path
        assert bench.web.token.encode() not in answer


def raw(web: WebBench, path: str) -> bytes:
    """The response to a path that no client would send."""
    with web.connect() as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        connection.shutdown(socket.SHUT_WR)
        return connection.makefile("rb").read()


def test_an_area_that_is_too_large_is_refused(bench: TileBench) -> None:
    bench.switch(on=True)
    answer = bench.post("/keep", "zoom=14&x=8500&y=5700&columns=4&rows=3")
    assert answer.status == 422
    assert f"at most {MOST_TILES} are kept at once: zoom in" in answer.data["error"]
    assert bench.post("/keep", "zoom=14&x=8500&y=5700&columns=4&rows=99999").status == 422
    assert bench.web.ask("/api/map/kept?zoom=16&x=0&y=0&columns=100&rows=100").status == 422
    assert bench.tiles.asked == []


def test_openstreetmaps_server_is_never_saved_from(tmp_path: Path) -> None:
    with ExitStack() as stack:
        web = web_daemon(Starter(tmp_path, stack))
        authorization = {"Authorization": f"Bearer {web.token}"}
        assert web.ask("/api/map?on=1", "POST", **authorization).data["credit"] == "© OpenStreetMap contributors"
        answer = web.ask(f"/api/map/keep?{AREA}", "POST", **authorization)
        assert (answer.status, "does not allow saving areas" in answer.data["error"]) == (422, True)


def test_kept_tiles_can_be_deleted(bench: TileBench) -> None:
    bench.switch(on=True)
    bench.keep(AREA)
    assert bench.post("/forget").status == 200
    assert bench.state()["tiles"] == 0
    until(lambda: bench.web.ask("/api/map/tiles/16/34000/23000").status == 404, "the end of the tile")
