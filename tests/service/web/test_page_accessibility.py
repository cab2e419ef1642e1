# SPDX-License-Identifier: GPL-3.0-or-later
"""axe-core's accessibility checks of the page in each state, on a laptop and a phone, light and dark."""

import importlib.util
from pathlib import Path

import pytest

from tests.support.chromium import LAPTOP, PHONE, Browser, Browsers
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.web_bench import EXAMPLE, WebBench

pytest_plugins = ("tests.support.web_fixtures",)


def axe_core() -> str:
    found = importlib.util.find_spec("axe_playwright_python")
    assert found is not None
    assert found.origin is not None
    return (Path(found.origin).parent / "axe.min.js").read_text()


def violations(page: Browser) -> list[str]:
    page.run(axe_core())
    # Also the rules that are off by default: enhanced contrast, the size of targets, experimental ones.
    run = """
        const done = arguments[arguments.length - 1];
        const rules = Object.fromEntries(axe.getRules().map((rule) => [rule.ruleId, { enabled: true }]));
        axe.run({ rules }).then((result) => done(result.violations.flatMap(
          (found) => found.nodes.map((node) => `${found.id}: ${node.html} ${node.failureSummary}`))));"""
    found: list[str] = page.driver.execute_async_script(run)
    return found


@pytest.mark.parametrize(("size", "dark"), [(LAPTOP, False), (PHONE, True)])
def test_axe_finds_no_violation_in_any_state(
    browsers: Browsers, web: WebBench, size: tuple[int, int], *, dark: bool
) -> None:
    assert web.board is not None
    with browsers.tab(web.port, size, dark=dark) as page:
        page.open()
        assert violations(page) == []  # without a mission
        web.daemon.push(plain_plan(9))
        web.push_example()
        page.wait_text("#held-text", "13 records")
        page.find("#file").send_keys(str(EXAMPLE))
        page.wait_text("#checked", "14 items")
        page.press("button[aria-label='Show mission 1']")
        page.wait_text("tr.detail h3", "Mission 1")
        page.find("#logs input").send_keys("wrong")
        page.press("#logs button")
        page.wait_text("#logs", "Wrong token")
        assert violations(page) == []
        web.board.set("armed 1")
        until(lambda: page.text("#badges") == "ARMED", "the armed craft")
        page.wait_text("#checked form", "disarm to write")
        assert violations(page) == []
        web.board.set("unplug")
        page.wait_text("#badges", "LOST")
        page.wait_text("#held-text", "13 records, checksum 068b9e81, as last read")  # it may still fly it
        assert violations(page) == []
        web.daemon.end()
        page.wait_text("#badges", "NO REPLY")
        assert violations(page) == []
