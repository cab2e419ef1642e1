# SPDX-License-Identifier: GPL-3.0-or-later
"""Debian's Chromium, headless, in place of a pilot's phone or laptop."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from selenium.webdriver import Chrome, ChromeOptions, ChromeService
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

from tests.support.programs import TIMEOUT_S, happens, until

PHONE = (390, 844)
LAPTOP = (1280, 900)
TASKS = ("fly", "mission", "check", "pi")
_PLAIN = ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--disable-gpu")
#: A renderer costs as much as the browser's start, and one is kept ready for each further page.
_ONE_RENDERER = (
    *("--process-per-site", "--disable-site-isolation-trials", "--renderer-process-limit=1"),
    "--disable-features=SpareRendererForSitePerProcess,BackForwardCache",
)
_WATCH_CLICK = """
    const wanted = document.querySelector(arguments[0]);
    window.missed = true;
    const look = click => { window.missed = !wanted.contains(click.target) };
    document.addEventListener("click", look, {once: true, capture: true});
    wanted.scrollIntoView({block: "center"});
"""


class Browser:
    """One tab with a daemon's page."""

    def __init__(self, driver: Chrome, port: int) -> None:
        self.driver = driver
        self.url = f"http://127.0.0.1:{port}/"

    def open(self, task: str = "fly", token: str = "") -> None:
        """Load the page, with a token as from its QR code, and wait until it shows the daemon's state in this task."""
        self.driver.get("about:blank")  # a new address that differs only in its fragment would load nothing
        self.driver.get(f"{self.url}#token={token}" if token else self.url)
        self.show(task)

    def show(self, task: str) -> None:
        """Change to another task, and wait for the next state."""
        self.run("location.hash = arguments[0]", task)
        self.wait_for_updates(1)

    def resize(self, width: int, height: int) -> None:
        # The window has a minimum width, and a phone is narrower.
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def darken(self, dark: bool) -> None:
        feature = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})

    def unfold(self, selector: str) -> None:
        self.run("document.querySelector(arguments[0]).open = true", selector)

    def enter_token(self, token: str) -> None:
        """Answer the page's question for its token."""
        until(lambda: self.run("return document.getElementById('token-dialog').open"), "the question for the token")
        self.find("#token").send_keys(token)
        self.press("#token-dialog button")

    def wait_for_updates(self, more: int) -> None:
        """Wait until the page has requested the state this many more times."""
        wanted = self._updates() + more
        until(lambda: self._updates() >= wanted, "another state request from the page")

    def _updates(self) -> int:
        return int(self.run("return document.body ? document.body.dataset.looks || 0 : 0"))

    def run(self, script: str, *arguments: object) -> Any:
        return self.driver.execute_script(script, *arguments)

    def find(self, selector: str) -> WebElement:
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector: str) -> list[WebElement]:
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def text(self, selector: str) -> str:
        """The visible text, even while the page is being redrawn."""
        script = "const e = document.querySelector(arguments[0]); return e?.innerText ?? e?.textContent ?? ''"
        return str(self.run(script, selector))

    def wait_text(self, selector: str, text: str) -> None:
        assert happens(lambda: text in self.text(selector)), f"no {text!r} in {selector}, but {self.text(selector)!r}"

    def press(self, selector: str) -> None:
        """Scroll it into view and click it; again if the page moved meanwhile and something else was hit."""
        until(lambda: self._hits(selector), f"a click on {selector}")

    def _hits(self, selector: str) -> bool:
        self.run(_WATCH_CLICK, selector)
        self.find(selector).click()
        return not self.run("return window.missed")  # undefined if the click has opened another page

    def value(self, name: str) -> str:
        """The value of a name in the overview."""
        script = "return [...document.querySelectorAll('dt')].find(e => e.innerText === arguments[0])"
        return str(self.run(f"{script}?.nextElementSibling.innerText ?? ''", name))

    def errors(self) -> list[str]:
        """Errors and Content-Security-Policy violations that the browser logged since the last call."""
        return [entry["message"] for entry in self._log("browser") if entry["level"] in ("SEVERE", "WARNING")]

    def traffic(self) -> tuple[set[str], int]:
        """The URLs requested since the last call, and the number of bytes received."""
        addresses, size = set(), 0
        for entry in self._log("performance"):
            event = json.loads(entry["message"])["message"]
            if event["method"] == "Network.requestWillBeSent":
                addresses.add(event["params"]["request"]["url"])
            if event["method"] == "Network.loadingFinished":
                size += int(event["params"]["encodedDataLength"])
        return addresses, size

    def _log(self, kind: str) -> list[dict[str, Any]]:
        entries: list[dict[str, Any]] = self.driver.get_log(kind)  # type: ignore[no-untyped-call]
        return entries

    def picture(self, path: Path) -> None:
        assert self.driver.save_screenshot(str(path))


class Browsers:
    """One Chromium, started once and kept until `close`, because its start takes longer than most tests.

    Needs Debian's packages chromium and chromium-driver.
    """

    def __init__(self) -> None:
        self._driver: Chrome | None = None

    @contextmanager
    def tab(self, port: int, size: tuple[int, int] = LAPTOP, *, dark: bool = False) -> Iterator[Browser]:
        """A browser's only tab, with `size` pixels, for the page at `port`."""
        driver = self._driver = self._driver or _start()
        page = Browser(driver, port)
        page.resize(*size)
        page.darken(dark)
        page.traffic()
        page.errors()
        try:
            yield page
        finally:
            driver.execute_cdp_cmd("Storage.clearDataForOrigin", {"origin": page.url, "storageTypes": "all"})
            driver.get("about:blank")

    def close(self) -> None:
        if self._driver is not None:
            self._driver.quit()


def _start() -> Chrome:
    programs = {name: shutil.which(name) for name in ("chromium", "chromedriver")}
    if not all(programs.values()):
        pytest.skip("no browser here: apt-get install chromium chromium-driver")
    options = ChromeOptions()
    options.binary_location = str(programs["chromium"])
    for argument in (*_PLAIN, *_ONE_RENDERER):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = Chrome(options, ChromeService(str(programs["chromedriver"])))
    driver.set_page_load_timeout(TIMEOUT_S * 2)
    driver.set_script_timeout(TIMEOUT_S)
    return driver
