# SPDX-License-Identifier: GPL-3.0-or-later
"""Map tiles on the page: off, on, in the right place, kept for the field, and without any network."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.axe import violations
from tests.support.chromium import LAPTOP, PHONE, Browser, Browsers
from tests.support.png import pixels
from tests.support.programs import until
from tests.support.tile_bench import TileBench, tile_bench
from tests.support.tile_server import QUARTERS

pytest_plugins = ("tests.support.web_fixtures",)


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[TileBench]:
    with tile_bench(tmp_path) as bench:
        bench.web.push_example()
        yield bench


def switch_on(page: Browser, bench: TileBench) -> None:
    """As a pilot does: with the token, on the page."""
    page.press("#map-tiles summary")
    page.find("#map-tiles input").send_keys(bench.web.token)
    page.press("#map-tiles button")
    until(lambda: shown(page) > 3, "the tiles")


def shown(page: Browser) -> int:
    return len(page.all("#map .map-tile img.loaded"))


def press(page: Browser, text: str) -> None:
    page.run("document.querySelector('#map-tiles').open = true")
    page.run(
        "[...document.querySelectorAll('#map-tiles button')].find((each) => each.innerText === arguments[0]).click()",
        text,
    )


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
        switch_on(page, bench)
        assert bench.tiles.headers["Referer"] == page.url  # OpenStreetMap refuses browsers that hide it
        for _ in range(2):
            until(lambda: shown(page) == len(page.all("#map .map-tile")), "all tiles")
            found, expected = crossing(page), waypoint(page)
            assert found == pytest.approx(expected, abs=2.5)  # the pixels of a tile, enlarged, and of the screen
            page.press("#map .map-tools button")
        assert page.errors() == []


def test_an_area_is_kept_for_a_field_without_a_network(browsers: Browsers, bench: TileBench) -> None:
    with browsers.tab(bench.web.port, LAPTOP) as page:
        page.open()
        until(lambda: len(page.all("#map .point")) > 2, "the waypoints")
        switch_on(page, bench)
        assert page.text("#map .map-credit") == bench.tiles.host
        press(page, "Keep this area for the field")
        page.wait_text("#map-tiles", "tiles of this area are kept.")
        assert violations(page) == []
        # In the field neither the Pi nor the phone reaches the source.
        bench.tiles.reply = lambda *_: (503, {}, b"")
        page.open()
        until(lambda: shown(page) > 3, "the kept tiles")
        page.run("document.querySelector('#map-tiles').open = true")
        page.find("#map-tiles input").send_keys(bench.web.token)
        press(page, "Delete the kept tiles")
        page.wait_text("#map-tiles .result", "Deleted.")
        page.driver.execute_cdp_cmd("Network.clearBrowserCache", {})
        page.open()
        page.wait_text("#map .map-credit", "No map tiles here")
        assert violations(page) == []
        assert all(bench.tiles.host in message for message in page.errors())


def test_the_pilot_stops_keeping_and_returns_to_plain_ground(browsers: Browsers, bench: TileBench) -> None:
    with browsers.tab(bench.web.port, PHONE, dark=True) as page:
        page.open()
        until(lambda: len(page.all("#map .point")) > 2, "the waypoints")
        switch_on(page, bench)
        bench.tiles.pause_s = 2
        press(page, "Keep this area for the field")
        until(lambda: page.find("#keep-bar").is_displayed(), "the progress")
        assert violations(page) == []
        press(page, "Stop")
        page.wait_text("#map-tiles .result", "Stopped.")
        bench.tiles.pause_s = 0
        press(page, "Show plain ground")
        until(lambda: not bench.state()["on"], "the end of the tiles")
        page.wait_for_updates(2)
        asked = len(bench.tiles.asked)
        page.open()
        page.wait_for_updates(2)
        assert (shown(page), len(bench.tiles.asked)) == (0, asked)
        assert page.run("return document.documentElement.scrollWidth") <= PHONE[0]
        assert page.errors() == []
