# SPDX-License-Identifier: GPL-3.0-or-later
"""The status page in Chromium, on a laptop and on a phone."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.chromium import LAPTOP, PHONE, TASKS, Browser, Browsers
from tests.support.plan import plain_plan
from tests.support.programs import run_naze_bridge, until
from tests.support.take_pictures import PICTURES, take_pictures
from tests.support.web_bench import WebBench, web_bench

pytest_plugins = ("tests.support.web_fixtures",)

FIRST_PAINT_BYTES = 200_000
PICTURE_BYTES = 250_000


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WebBench]:
    with web_bench(tmp_path_factory.mktemp("page")) as bench:
        bench.daemon.push(plain_plan(9))
        bench.push_example()
        yield bench


@pytest.fixture(scope="module")
def laptop(browsers: Browsers, bench: WebBench) -> Iterator[Browser]:
    with browsers.tab(bench.port, LAPTOP) as laptop:
        yield laptop


@pytest.fixture
def page(laptop: Browser) -> Iterator[Browser]:
    """The page, just opened; afterwards the browser must have logged no error."""
    laptop.errors()
    laptop.traffic()
    laptop.open()
    yield laptop
    assert laptop.errors() == []


def test_the_first_paint_is_small_and_self_contained(page: Browser) -> None:
    addresses, size = page.traffic()
    assert addresses
    assert {address for address in addresses if not address.startswith(page.url)} == set()
    assert 5_000 < size <= FIRST_PAINT_BYTES


def test_an_immediate_reload_loads_every_file(page: Browser) -> None:
    """Each load takes about thirty connections; the limit is fifty a second per address."""
    for _ in range(6):
        page.driver.get(page.url)
    page.open()


def test_the_overview_has_the_vehicles_values(page: Browser) -> None:
    until(lambda: page.text("#badges") == "DISARMED", "the craft")
    page.wait_text("#headline", "12.6 V")
    assert page.text("#headline") == "STABILIZE, 12.6 V, Harakiri with the mission extension"
    assert (page.value("State"), page.value("Mode")) == ("disarmed", "STABILIZE")
    assert page.value("Battery") == "12.6 V"
    assert page.value("Battery left") == "about 100 %"
    assert page.value("Protocol") == "MSP"
    assert "115200 baud" in page.value("Port")
    assert page.value("Mission").startswith("13 records, ")


def test_the_map_shows_track_waypoints_roi_home_and_craft(page: Browser) -> None:
    assert len(page.all("#map .track")) == 10
    assert len(page.all("#map .back")) == 1
    # Each in a single script, because the map is redrawn and elements found earlier disappear.
    numbers = page.run("return [...document.querySelectorAll('#map .number')].map((mark) => mark.textContent)")
    assert numbers == ["2", "3", "4", "5", "6", "7", "8", "9", "10"]
    assert len(page.all("#map .roi")) == 1
    assert len(page.all("#map .home")) == len(page.all("#map .craft-mark")) == len(page.all("#map .north")) == 1
    assert page.text("#map .scale + text").endswith(" m")
    words = page.run("return document.querySelector('#map svg').getAttribute('aria-label')")
    assert words == "Map with 9 positions of the mission; the craft is 0 m from home"
    inside = """
        const box = document.querySelector('#map svg').getBoundingClientRect();
        return [...document.querySelectorAll('#map svg circle, #map svg path')].every((mark) => {
          const own = mark.getBoundingClientRect();
          return own.left >= box.left && own.right <= box.right && own.top >= box.top && own.bottom <= box.bottom;
        });"""
    assert page.run(inside)


def test_the_scale_is_right(page: Browser) -> None:
    """Home and waypoint 2 are 37.1 m apart on the map."""
    bar = page.run("return document.querySelector('#map .scale').getBBox().width")
    metres = float(page.text("#map .scale + text").removesuffix(" m"))
    track = page.run("return document.querySelector('#map .track').getAttribute('points')")
    (x1, y1), (x2, y2) = ([float(number) for number in point.split(",")] for point in track.split()[:2])
    assert ((x1 - x2) ** 2 + (y1 - y2) ** 2) ** 0.5 * metres / bar == pytest.approx(37.1, abs=0.4)


def test_the_last_upload_is_shown_as_sent_and_as_stored(page: Browser) -> None:
    page.show("mission")
    page.unfold("#upload-block")
    assert page.text("#upload b") == "VERIFIED"
    assert len(page.all("#upload tr.changed")) == 6
    dropped = page.text("#upload tr.dropped")
    assert "DO_CHANGE_SPEED" in dropped
    assert "dropped: not stored\nnot supported" in dropped
    assert page.text("#upload tr:nth-child(2) td:nth-child(2) .is-changed") == "Alt 20 m"
    assert page.text("#upload tr:nth-child(2) td:nth-child(3) .is-changed") == "Alt 15 m"
    assert page.text("#upload tr:nth-child(2) .why") == "Alt: take-off 2..15 m"
    assert "Delay 3" in page.text("#upload")  # as in Mission Planner
    colours = [page.run("return getComputedStyle(document.querySelector(arguments[0])).backgroundColor", selector)
               for selector in ("#upload tr.changed .is-changed", "#upload tr.dropped", "#upload tr.same")]  # fmt: skip
    assert len(set(colours)) == 3


@pytest.fixture
def own_bench(tmp_path: Path) -> Iterator[WebBench]:
    with web_bench(tmp_path) as bench:
        bench.daemon.push(plain_plan(9))
        yield bench


def test_foreign_text_is_not_markup(browsers: Browsers, own_bench: WebBench) -> None:
    """File names and texts of ground stations come from outside."""
    evil = "<img src=x onerror=alert(1)><script>alert(2)</script>"
    item = {"command": 16, "frame": 3, "p1": 0, "p2": 3, "p3": 0, "p4": 0, "lat_e7": 453838000, "lon_e7": 84733000}
    items = [item | {"seq": seq, "alt_m": 10} for seq in range(3)]
    own_bench.daemon.ask({"do": "push", "source": evil, "items": items})
    with browsers.tab(own_bench.port) as page:
        page.open()
        assert evil in page.text("#missions")
        assert evil in page.text("#upload")
        assert page.all("#missions img, #upload img, main script") == []
        assert page.errors() == []


def test_the_page_fits_a_phone(browsers: Browsers, bench: WebBench) -> None:
    with browsers.tab(bench.port, PHONE) as phone:
        for task in TASKS:
            phone.open(task)
            assert phone.run("return [window.innerWidth, document.documentElement.scrollWidth]") == [PHONE[0]] * 2
            assert phone.run("return document.documentElement.scrollHeight") <= PHONE[1], task
            primary = "return [...document.querySelectorAll('main .primary')].filter(e => e.checkVisibility()).length"
            assert phone.run(primary) == 1
        phone.show("mission")
        for block in ("#upload-block", "#missions-block", "#missions details"):
            phone.unfold(block)
        phone.wait_text("#missions", "Write mission 2 again")
        phone.press("#upload .show-all")
        assert phone.run("return document.documentElement.scrollWidth") == PHONE[0]
        cut = "e => e.scrollWidth > e.clientWidth + 1"
        assert (
            phone.run(f"return [...document.querySelectorAll('.scrolls, section, td, dd, li, p')].filter({cut}).length")
            == 0
        )
        fields = "button, input:not([type=checkbox], .unseen), summary"
        small = "e => e.checkVisibility() && e.getBoundingClientRect().height < 38"  # a finger's width
        assert phone.run(f"return [...document.querySelectorAll('{fields}')].filter({small}).length") == 0


def test_a_page_without_mission_and_position_explains_it(browsers: Browsers, tmp_path: Path) -> None:
    with web_bench(tmp_path) as bench, browsers.tab(bench.port) as page:
        page.open("mission")
        page.unfold("#missions-block")
        page.unfold("#upload-block")
        page.wait_text("#missions", "No mission has been received yet.")
        page.wait_text("#upload", "No mission has been received yet.")
        page.wait_text("#held-text", "No mission.")
        ended = run_naze_bridge("push", "--state-dir", bench.daemon.state_dir, "examples/long-146.waypoints")
        assert ended.returncode == 0, ended.stderr
        page.wait_text("#held-text", "146 records")
        assert len(page.all("#map .number")) > 100
        assert page.errors() == []


def test_every_picture_in_the_docs_is_taken(tmp_path: Path) -> None:
    take_pictures(tmp_path)
    taken = sorted(path.name for path in tmp_path.iterdir())
    assert taken == sorted(path.name for path in PICTURES.glob("*.png"))
    page = (PICTURES.parent / "status-page.md").read_text()
    for name in taken:
        assert f"(pictures/{name})" in page
        assert 5_000 < (PICTURES / name).stat().st_size <= PICTURE_BYTES
