# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeping an area: stopped by the pilot, by arming and by a restart, and continued."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.programs import until
from tests.support.tile_bench import AREA, TileBench, tile_bench
from tests.support.tile_server import plain


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[TileBench]:
    with tile_bench(tmp_path) as bench:
        bench.switch(on=True)
        yield bench


def begin_slowly(bench: TileBench) -> None:
    """Begin to keep the area, with a source that never finishes in time."""
    bench.tiles.pause_s = 1.0
    assert bench.post("/keep", AREA).status == 202
    until(lambda: bench.state()["keeping"]["done"] > 1, "the first tiles")


def test_it_is_stopped_and_continued(bench: TileBench) -> None:
    begin_slowly(bench)
    assert bench.post("/keep", AREA).status == 409
    assert bench.post("/forget").status == 409
    bench.post("/stop")
    stopped = bench.ended()
    assert stopped["text"].startswith("Stopped. ")
    assert "press again to continue" in stopped["text"]
    assert bench.state()["tiles"] == stopped["tiles"] > 0
    bench.tiles.pause_s = 0
    bench.tiles.asked.clear()
    assert bench.keep(AREA)["text"] == "46 tiles of this area are kept."
    assert len(bench.tiles.asked) <= 46 - stopped["done"]


def test_arming_ends_it_and_an_armed_craft_never_begins_it(bench: TileBench) -> None:
    begin_slowly(bench)
    bench.board.set("armed 1")
    assert bench.ended()["text"].startswith("The craft was armed. ")
    asked = len(bench.tiles.asked)
    answer = bench.post("/keep", AREA)
    assert (answer.status, answer.data["error"]) == (409, "The craft is armed: disarm it first.")
    bench.tiles.pause_s = 0
    assert len(bench.tiles.asked) == asked


def test_switching_tiles_off_ends_it(bench: TileBench) -> None:
    begin_slowly(bench)
    bench.switch(on=False)
    assert bench.ended()["text"].startswith("Stopped. ")


def test_the_reason_for_a_failure_is_shown(bench: TileBench) -> None:
    bench.tiles.reply = lambda *_: (403, {}, b"blocked")
    text = bench.keep(AREA)["text"]
    assert text.startswith(f"{bench.tiles.host} refuses /")
    assert text.endswith("0 of 46 tiles are kept; press again to continue.")
    bench.tiles.reply = lambda zoom, *_: (200, {}, plain()) if zoom < 18 else (404, {}, b"")
    assert bench.keep(AREA)["text"] == "14 tiles of this area are kept. 32 more do not exist."


def test_the_daemon_stops_at_once_while_an_area_is_fetched(bench: TileBench) -> None:
    begin_slowly(bench)
    bench.web.daemon.end()
