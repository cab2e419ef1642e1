# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing a mission from the page: next to a button appears only its own result."""

from pathlib import Path

import pytest

from tests.support.chromium import PHONE, Browser, Browsers
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.web_bench import EXAMPLE, WebBench

pytest_plugins = ("tests.support.web_fixtures",)

ENTRY = "#missions details[data-number='1']"
DETAIL = f"{ENTRY} .result"
FILE_RESULT = "#checked .result"


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
        page.open("mission")
        page.unfold("#missions-block")
        page.unfold(ENTRY)
        page.wait_text(ENTRY, "Write mission 1 again")
        page.press(f"{ENTRY} button.write")
        page.enter_token("not the token")
        page.wait_text("#token-why", "This token is wrong.")
        page.press("#token-dialog button[formnovalidate]")
        page.wait_text(DETAIL, "This needs the page's token.")
        assert is_visible(page, DETAIL)
        assert page.run("return window.innerWidth") == PHONE[0]
        assert bench.board.records() != first

        bench.restore(1)  # another client's success must not replace the error
        upload = "return document.getElementById('upload').textContent"
        until(lambda: "restore of mission 1" in page.run(upload), "the other client's upload")
        page.wait_for_updates(2)
        assert page.text(DETAIL) == "This needs the page's token."
        bench.push_example()

        page.press(f"{ENTRY} button.write")
        page.enter_token(bench.token)
        page.wait_text(DETAIL, "9 of 9 stored: ")
        assert is_visible(page, DETAIL)
        assert bench.board.records() == first
        page.wait_text("#held-text", "9 records")
        # It is still open, although the list has grown.
        assert page.run("return document.querySelector(arguments[0]).open", ENTRY)

        bench.board.set("armed 1")
        until(lambda: page.text("#badges") == "ARMED", "the armed craft")
        assert not page.find(f"{ENTRY} button.write").is_enabled()


def test_a_file_is_checked_drawn_and_written(browsers: Browsers, bench: WebBench) -> None:
    assert bench.board is not None
    before = bench.board.records()
    with browsers.tab(bench.port, PHONE) as page:
        page.open("mission")
        page.find("#file").send_keys(str(EXAMPLE))
        page.wait_text("#checked", "naze-field.waypoints: 14 items, 6 changed, 1 dropped.")
        shown = page.run("return [...document.querySelectorAll('#checked tbody tr')].filter(e => e.offsetHeight)"
                         ".map(e => e.className)")  # fmt: skip
        assert sorted(shown) == ["changed"] * 6 + ["dropped"]
        page.press("#checked .show-all")
        assert page.run("return document.querySelector('#checked tr.same').offsetHeight") > 0
        page.wait_text("#file-map svg", "H")
        # The ten legs that the board flies: to each placed item but the ROI, home, and down.
        assert len(page.all("#file-map .track")) == 10
        assert bench.board.records() == before
        page.press("#checked button.write")
        page.enter_token(bench.token)
        page.wait_text(FILE_RESULT, "13 of 14 stored: 1 danger, 1 dropped")
        assert bench.board.records() != before
        page.wait_text("#upload", "naze-field.waypoints, from the page")
        page.press("#checked .row > button")
        page.wait_text("#held-text", "13 records")
        assert page.errors() == []


def test_a_list_that_would_be_rejected_cannot_be_written(browsers: Browsers, bench: WebBench, tmp_path: Path) -> None:
    lines = EXAMPLE.read_text().splitlines()
    (tmp_path / "rejected.waypoints").write_text("\n".join([*lines, lines[2].replace("1\t", f"{len(lines) - 1}\t", 1)]))
    with browsers.tab(bench.port) as page:
        page.open()
        page.find("#file").send_keys(str(tmp_path / "rejected.waypoints"))
        page.wait_text("#checked", "rejected.waypoints would be rejected")
        assert page.all("#checked tr.rejected")
        assert page.all("#checked button.write") == []
