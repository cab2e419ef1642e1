# SPDX-License-Identifier: GPL-3.0-or-later
"""The map's zoom and pan, and the download of a telemetry log."""

from pathlib import Path

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from service.daemon.telemetry_logs import PIECE
from tests.support.chromium import PHONE, Browser, Browsers
from tests.support.programs import until
from tests.support.web_bench import WebBench

pytest_plugins = ("tests.support.web_fixtures",)


def place(page: Browser) -> list[float]:
    """The centre of waypoint 2, pixels."""
    script = "const c = document.querySelectorAll('#map .point')[1]; return [c.cx.baseVal.value, c.cy.baseVal.value]"
    found: list[float] = page.run(script)
    return found


def test_the_map_is_zoomed_and_panned(browsers: Browsers, shared_web: WebBench) -> None:
    with browsers.tab(shared_web.port) as page:
        page.open()
        until(lambda: len(page.all("#map .point")) > 2, "the waypoints")
        fit, scale = place(page), page.text("#map .scale + text")
        for _ in range(4):
            page.press("#map button")
        zoomed = place(page)
        assert zoomed != fit
        assert page.text("#map .scale + text") != scale
        page.find("#map button").send_keys(Keys.ARROW_RIGHT)
        panned = place(page)
        assert (panned[0] < zoomed[0], panned[1]) == (True, zoomed[1])
        canvas = page.find("#map .map-canvas")
        ActionChains(page.driver).move_to_element(canvas).click_and_hold().move_by_offset(50, 30).release().perform()
        dragged = place(page)
        assert [round(new - old) for new, old in zip(dragged, panned, strict=True)] == [50, 30]
        page.wait_for_updates(2)
        assert place(page) == dragged  # an update does not move it back
        page.press("#map button:last-child")
        assert place(page) == fit


def test_a_log_is_downloaded(browsers: Browsers, shared_web: WebBench, tmp_path: Path) -> None:
    folder = shared_web.daemon.state_dir / "logs"
    folder.mkdir(exist_ok=True)
    name, contents = "2026-01-02 03-04-05.tlog", bytes(range(256)) * (PIECE // 100)
    (folder / name).write_bytes(contents)
    downloads = tmp_path / "downloads"
    with browsers.tab(shared_web.port, PHONE) as page:
        allow = {"behavior": "allow", "downloadPath": str(downloads)}
        page.driver.execute_cdp_cmd("Browser.setDownloadBehavior", allow)
        page.open("check")
        page.unfold("#logs-block")
        page.enter_token(shared_web.token)
        page.wait_text("#logs", name)
        page.press(f"button[aria-label='Download {name}']")
        until(lambda: (downloads / name).exists() and (downloads / name).read_bytes() == contents, "the log")
        page.wait_text("#logs", "Downloaded")
        assert page.run("return document.documentElement.scrollWidth") <= PHONE[0]
        assert page.errors() == []


def test_a_finger_reads_heights_on_the_map(browsers: Browsers, shared_web: WebBench) -> None:
    with browsers.tab(shared_web.port, PHONE) as page:
        page.open()
        until(lambda: len(page.all("#map .point")) > 2, "the waypoints")
        page.run("""
            const mark = document.querySelectorAll("#map .point")[1], box = mark.getBoundingClientRect();
            const at = { clientX: box.left + box.width / 2 + 9, clientY: box.top - 5, bubbles: true };
            document.querySelector("#map svg").dispatchEvent(new MouseEvent("click", at))""")
        assert page.text("#map .map-note") == page.run(
            "return document.querySelectorAll('#map .point')[1].parentNode.querySelector('title').textContent"
        )
        assert page.text("#map .map-note").endswith(" m")


def test_the_token_in_the_address_is_used_and_hidden(browsers: Browsers, shared_web: WebBench) -> None:
    with browsers.tab(shared_web.port, PHONE) as page:
        page.driver.get(f"{page.url}#token={shared_web.token}")
        page.wait_for_updates(1)
        assert page.run("return location.href") == page.url
        page.driver.refresh()  # kept until the tab is closed
        page.show("check")
        page.unfold("#logs-block")
        page.wait_text("#logs", "logs")
        assert not page.run("return document.getElementById('token-dialog').open")
