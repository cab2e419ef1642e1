# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission in flight on the page: the item that is flown, and the track."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from simulator.inav.boxes import BOXES, NAV_WP
from tests.support.axe import violations
from tests.support.benches import Starter
from tests.support.chromium import Browsers
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.web_bench import WebBench, web_daemon

pytest_plugins = ("tests.support.web_fixtures",)

FLOWN = "return [...document.querySelectorAll('#map .flown .number')].map((mark) => mark.textContent)"
TRAIL = "return document.querySelector('#map .trail')?.getAttribute('points').split(' ').length ?? 0"


@pytest.fixture
def flying(tmp_path: Path) -> Iterator[WebBench]:
    """An INAV that flies its mission by itself."""
    with ExitStack() as stack:
        start = Starter(tmp_path, stack)
        board = start.board("--kind", "inav", tcp=True)
        bench = web_daemon(start, board.fc)
        bench.daemon.push(plain_plan(9))
        board.set(f"boxes {1 << BOXES['9.1.0'].index(NAV_WP)}")
        board.set("armed 1")
        yield WebBench(bench.daemon, board, bench.port)


def test_the_item_in_flight_and_the_track_are_shown(browsers: Browsers, flying: WebBench) -> None:
    assert flying.board is not None
    with browsers.tab(flying.port) as page:
        page.open()
        until(lambda: page.run(FLOWN), "the item in flight")
        assert "active at item" in page.value("Mission")
        assert "is flown now" in page.run("return document.querySelector('#map svg').getAttribute('aria-label')")
        until(lambda: page.run(TRAIL) >= 4, "the track")
        flown = page.run(TRAIL)
        assert violations(page) == []
        flying.board.set("armed 0")
        until(lambda: not page.run(FLOWN), "the end of the flight")
        assert page.run(TRAIL) >= flown, "the last flight's track stays"
