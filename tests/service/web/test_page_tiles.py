# SPDX-License-Identifier: GPL-3.0-or-later
"""Map tiles on the page: fetched by the browser once they are switched on in it, and in the right place."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support.axe import violations
from tests.support.benches import Starter
from tests.support.chromium import LAPTOP, PHONE, Browser, Browsers
from tests.support.png import pixels
from tests.support.programs import until
from tests.support.tile_server import QUARTERS, TileServer, plain, tile_server
from tests.support.web_bench import WebBench, web_daemon

pytest_plugins = ("tests.support.web_fixtures",)


@dataclass(frozen=True)
class TileBench:
    """A daemon whose page has its tiles from `tiles`."""

    web: WebBench
    tiles: TileServer


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[TileBench]:
    with ExitStack() as stack, tile_server() as tiles:
        start = Starter(tmp_path, stack)
        board = start.board()
        web = web_daemon(start, str(board.link), f'map_tiles = "{tiles.template}"\n')
        web.push_example()
        yield TileBench(web, tiles)


def shown(page: Browser) -> int:
    return len(page.all("#map .map-tiles img.loaded"))


def show_waypoint(bench: TileBench) -> None:
    """Let the tiles show the place of item 2."""
    item = next(each for each in bench.web.ask("/api/held").data["items"] if each["seq"] == 2)
    bench.tiles.show(item["lat_e7"] / 1e7, item["lon_e7"] / 1e7)


def crossing(page: Browser) -> tuple[float, float]:
    """The place on the map where the four colours of the tiles meet, pixels."""
    left, top = page.run("""
        document.getElementById("map").scrollIntoView({ block: "center" });
        for (const each of document.querySelectorAll("#map svg")) each.style.visibility = "hidden";
        const box = document.querySelector("#map .map-tiles").getBoundingClientRect();
        return [box.left, box.top]""")
    rows = pixels(page.driver.get_screenshot_as_png())
    page.run("for (const each of document.querySelectorAll('#map svg')) each.style.visibility = ''")
    south_west, north_west, north_east = (places(rows, bytes(QUARTERS[number])) for number in (0, 2, 3))
    # Where a tile is not drawn in its own size, the colours between two others belong to neither.
    between = max(x for x, _ in north_west) + 1 + min(x for x, _ in north_east)
    below = max(y for _, y in north_west) + 1 + min(y for _, y in south_west)
    return between / 2 - left, below / 2 - top


def places(rows: list[bytes], colour: bytes) -> list[tuple[int, int]]:
    """The pixels of a colour: each row's first and last."""
    found = []
    for y, row in enumerate(rows):
        columns = [at // 3 for at in range(0, len(row), 3) if row[at : at + 3] == colour]
        found += [(x, y) for x in columns[:1] + columns[-1:]]
    return found


def waypoint(page: Browser) -> tuple[float, float]:
    """The centre of item 2 on the map, pixels."""
    x, y = page.run("""
        const marks = [...document.querySelectorAll("#map g.touched")];
        const { cx, cy } = marks.find((mark) => mark.textContent.startsWith("2 ")).querySelector(".point");
        return [cx.baseVal.value, cy.baseVal.value]""")
    return x, y


def test_tiles_lie_under_the_places_that_they_show(browsers: Browsers, bench: TileBench) -> None:
    show_waypoint(bench)
    with browsers.tab(bench.web.port, PHONE) as page:
        page.open()
        until(lambda: len(page.all("#map .point")) > 2, "the waypoints")
        assert bench.tiles.asked == []
        page.press("#tiles-on")
        until(lambda: shown(page) > 3, "the tiles")
        assert bench.tiles.headers["Referer"] == page.url  # OpenStreetMap refuses browsers that hide it
        for _ in range(2):
            until(lambda: shown(page) == len(page.all("#map .map-tiles img")), "all tiles")
            found, expected = crossing(page), waypoint(page)
            assert found == pytest.approx(expected, abs=2.5)  # the pixels of a tile, enlarged, and of the screen
            page.press("#map .map-tools button")
        assert page.errors() == []


def test_the_browser_keeps_the_choice_and_says_why_there_are_no_tiles(browsers: Browsers, bench: TileBench) -> None:
    bench.tiles.reply = lambda *_: (503, {}, b"")
    with browsers.tab(bench.web.port, LAPTOP, dark=True) as page:
        page.open()
        page.press("#tiles-on")
        page.wait_text("#map .map-credit", f"No map tiles: this browser gets none from {bench.tiles.host}.")
        bench.tiles.reply = lambda *_: (200, {}, plain())
        page.open()
        page.wait_text("#map .map-credit", bench.tiles.host)
        until(lambda: shown(page) == len(page.all("#map .map-tiles img")), "all tiles")
        assert violations(page) == []
        page.press("#tiles-on")
        until(lambda: not page.all("#map .map-tiles img"), "the plain ground")
        asked = len(bench.tiles.asked)
        page.open()
        page.wait_for_updates(2)
        assert (shown(page), len(bench.tiles.asked)) == (0, asked)
        assert all(bench.tiles.host in message for message in page.errors())


def test_the_page_may_load_pictures_only_from_the_source_in_the_settings(bench: TileBench) -> None:
    policy = bench.web.ask("/").headers["content-security-policy"]
    assert f"img-src 'self' http://{bench.tiles.host};" in policy
    assert policy.count("http:") == 1
