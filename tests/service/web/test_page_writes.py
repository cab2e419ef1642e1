# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing a mission from the page: next to a button appears only its own result."""

from pathlib import Path

import pytest

from tests.support.chromium import PHONE, Browser, Browsers
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.web_bench import EXAMPLE, WebBench

pytest_plugins = ("tests.support.web_fixtures",)

DETAIL = "tr.detail .result"
FILE_RESULT = "#checked form .result"


@pytest.fixture
def bench(web: WebBench) -> WebBench:
    web.daemon.push(plain_plan(9))
    return web


def is_visible(page: Browser, selector: str) -> bool:
    script = """
        const box = document.querySelector(arguments[0]).getBoundingClientRect();
        const bar = document.querySelector('header').getBoundingClientRect();
        return box.top >= bar.bottom && box.bottom <= innerHeight;"""
    return bool(page.run(script, selector))


def test_a_stored_mission_is_written_with_the_token(browsers: Browsers, bench: WebBench) -> None:
    assert bench.board is not None
    first = bench.board.records()
    bench.push_example()
    with browsers.tab(bench.port, PHONE) as page:
        page.open()
        page.press("button[aria-label='Show mission 1']")
        page.wait_text("tr.detail h3", "Mission 1")
        page.find("tr.detail input").send_keys("not the token")
        page.press("tr.detail button.write")
        page.wait_text(DETAIL, "Wrong token. On the Pi")
        assert is_visible(page, DETAIL)
        assert page.run("return window.innerWidth") == PHONE[0]
        assert bench.board.records() != first

        bench.restore(1)  # another client's success must not replace the error
        page.wait_text("#upload", "restore of mission 1")
        page.wait_for_updates(2)
        assert page.text(DETAIL).startswith("Wrong token.")
        bench.push_example()

        page.find("tr.detail input").clear()
        page.find("tr.detail input").send_keys(bench.token)
        page.press("tr.detail button.write")
        page.wait_text(DETAIL, "9 of 9 stored: ")
        assert is_visible(page, DETAIL)
        assert bench.board.records() == first
        page.wait_text("#held-text", "9 records")
        page.wait_text("tr.detail h3", "Mission 1")  # still open, although the list has grown

        bench.board.set("armed 1")
        until(lambda: page.text("#badges") == "ARMED", "the armed craft")
        assert not page.find("tr.detail button.write").is_enabled()


def test_a_file_is_checked_drawn_and_written(browsers: Browsers, bench: WebBench) -> None:
    assert bench.board is not None
    before = bench.board.records()
    with browsers.tab(bench.port, PHONE) as page:
        page.open()
        page.find("#file").send_keys(str(EXAMPLE))
        page.wait_text("#checked", "naze-field.waypoints: 14 items, 6 changed, 1 dropped.")
        shown = page.run("return [...document.querySelectorAll('#checked tbody tr')].filter(e => e.offsetHeight)"
                         ".map(e => e.className)")  # fmt: skip
        assert sorted(shown) == ["changed"] * 6 + ["dropped"]
        page.press("#checked .show-all")
        assert page.run("return document.querySelector('#checked tr.same').offsetHeight") > 0
        page.wait_text("#file-map svg", "H")
        assert len(page.all("#file-profile .point")) == 12  # home, and all items but the ROI
        assert bench.board.records() == before
        page.find("#checked input.token").send_keys(bench.token)
        page.press("#checked button.write")
        page.wait_text(FILE_RESULT, "13 of 14 stored: 1 danger, 1 dropped")
        assert bench.board.records() != before
        page.wait_text("#upload", "naze-field.waypoints, from the page")
        assert page.errors() == []


def test_a_file_can_be_dropped_on_the_page(browsers: Browsers, bench: WebBench) -> None:
    drop = """
        const files = new DataTransfer();
        files.items.add(new File([arguments[0]], 'dropped.waypoints'));
        document.body.dispatchEvent(new DragEvent('drop', {bubbles: true, cancelable: true, dataTransfer: files}));"""
    with browsers.tab(bench.port) as page:
        page.open()
        page.run(drop, EXAMPLE.read_text())
        page.wait_text("#checked", "dropped.waypoints: 14 items")
        page.run(drop, "no mission")
        page.wait_text("#checked .bad", "dropped.waypoints")
        assert page.all("#checked button.write") == []


def test_a_list_that_would_be_rejected_cannot_be_written(browsers: Browsers, bench: WebBench, tmp_path: Path) -> None:
    lines = EXAMPLE.read_text().splitlines()
    (tmp_path / "rejected.waypoints").write_text("\n".join([*lines, lines[2].replace("1\t", f"{len(lines) - 1}\t", 1)]))
    with browsers.tab(bench.port) as page:
        page.open()
        page.find("#file").send_keys(str(tmp_path / "rejected.waypoints"))
        page.wait_text("#checked", "rejected.waypoints would be rejected")
        assert page.all("#checked tr.rejected")
        assert page.all("#checked button.write") == []
