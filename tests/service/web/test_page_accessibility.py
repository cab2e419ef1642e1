# SPDX-License-Identifier: GPL-3.0-or-later
"""axe-core's accessibility checks of the page in each state, on a laptop and a phone, light and dark."""

from tests.support.axe import violations
from tests.support.chromium import LAPTOP, PHONE, TASKS, Browser, Browsers
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.web_bench import EXAMPLE, WebBench

pytest_plugins = ("tests.support.web_fixtures",)


def violations_of(page: Browser) -> list[str]:
    found = violations(page)
    page.resize(*PHONE)
    page.darken(True)
    found += violations(page)
    page.resize(*LAPTOP)
    page.darken(False)
    return found


def test_axe_does_not_find_a_violation_in_any_state(browsers: Browsers, web: WebBench) -> None:
    assert web.board is not None
    with browsers.tab(web.port) as page:
        for task in TASKS:  # without a mission
            page.open(task)
            assert violations_of(page) == []
        page.show("mission")
        web.daemon.push(plain_plan(9))
        web.push_example()
        page.wait_text("#held-text", "13 records")
        page.find("#file").send_keys(str(EXAMPLE))
        page.wait_text("#checked", "14 items")
        assert violations_of(page) == []
        page.press("#checked button.write")
        page.enter_token("wrong")
        page.wait_text("#token-why", "This token is wrong.")
        assert violations_of(page) == []
        page.press("#token-dialog button[formnovalidate]")
        page.wait_text("#checked", "This needs the page's token.")
        web.board.set("armed 1")
        until(lambda: page.text("#badges") == "ARMED", "the armed craft")
        page.wait_text("#checked", "disarm to write")
        assert violations_of(page) == []
        web.board.set("unplug")
        page.wait_text("#badges", "LOST")
        page.press("#checked .row > button")
        page.wait_text("#held-text", "13 records, checksum 068b9e81, as last read")  # it may still fly it
        for block in ("#upload-block", "#missions-block", "#missions details"):
            page.unfold(block)
        page.wait_text("#missions", "Write mission 2 again")
        for task in ("mission", "fly"):
            page.show(task)
            assert violations_of(page) == []
        web.daemon.end()
        page.wait_text("#badges", "NO REPLY")
        assert violations_of(page) == []
