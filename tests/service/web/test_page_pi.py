# SPDX-License-Identifier: GPL-3.0-or-later
"""What the page does for the Pi itself: first questions, doctor's remedies, settings, log, update."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from service.cli.helper.signature import SIGNERS
from service.cli.setup.answers import KEY_FILE, SETTINGS_FILE
from tests.service.cli.doctor.test_fixes import console
from tests.service.cli.helper.test_packages import packed
from tests.support.axe import violations
from tests.support.chromium import PHONE, Browser, Browsers
from tests.support.fixable_pi import FixablePi
from tests.support.helper_bench import helper_bench
from tests.support.programs import until
from tests.support.web_bench import WebBench

pytest_plugins = ("tests.support.web_fixtures",)


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[WebBench, FixablePi]]:
    with helper_bench(tmp_path, monkeypatch) as both:
        yield both


def opened(page: Browser, web: WebBench) -> None:
    """Open the part for the Pi with the token from the address."""
    page.open("pi", web.token)
    page.wait_text("#pi", "Raspberry Pi 4 Model B, kite")


def press(page: Browser, text: str) -> None:
    """Press the button with this text once it can be pressed."""
    find = """
        const button = [...document.querySelectorAll("main button")].find((each) => each.textContent === arguments[0]);
        if (!button || button.disabled) return false;
        button.scrollIntoView({ block: "center" });
        button.click();
        return true;"""
    until(lambda: page.run(find, text), f"the button {text}")


def unfold(page: Browser, title: str) -> None:
    page.run(
        "[...document.querySelectorAll('#pi summary')].find((each) => each.textContent === arguments[0]).click()", title
    )


def fill(page: Browser, name: str, text: str) -> None:
    field = page.find(f"#pi [name='{name}']")
    field.clear()
    field.send_keys(text)


def fits_a_phone(page: Browser) -> bool:
    return bool(page.run("return document.documentElement.scrollWidth") <= PHONE[0])


def test_first_questions_remedies_settings_and_log(browsers: Browsers, bench: tuple[WebBench, FixablePi]) -> None:
    web, pi = bench
    with browsers.tab(web.port, PHONE) as page:
        opened(page, web)
        assert page.run("return document.querySelector('#pi details[open] summary').textContent") == "First questions"
        fill(page, "hotspot", "field")
        fill(page, "password", "long-enough")
        fill(page, "country", "DE")
        press(page, "Show the changes")
        page.wait_text("#pi", "open the Wi-Fi hotspot 'field'")
        page.wait_text("#pi", "Join it within 3 minutes")
        assert not pi.path(SETTINGS_FILE).exists()
        assert violations(page) == []
        press(page, "Make these changes")
        page.wait_text("#pi", "The Wi-Fi changes in a few seconds.")
        assert 'listen = "0.0.0.0:8080"' in pi.read(SETTINGS_FILE)

        opened(page, web)
        console(pi)
        page.show("check")
        press(page, "Check everything")
        page.wait_text("#findings", "Problem console")
        assert "bad" in page.run("return document.querySelector('#doctor .result').className")
        assert fits_a_phone(page)
        assert violations(page) == []
        press(page, "Fix it: free the UART from the login console")
        page.wait_text("#doctor", "Switch the Pi off and on for this to take effect")
        page.unfold("#findings details")
        page.wait_text("#findings", "Fine console")
        assert "console=serial0" not in pi.read("/boot/firmware/cmdline.txt")

        page.unfold("#log-block")
        page.wait_text("#log", "Status page pi request: action doctor")
        assert violations(page) == []
        assert fits_a_phone(page)

        page.show("pi")
        unfold(page, "Settings of the bridge")
        fill(page, "sysid", "900")
        press(page, "Save")
        assert page.run("return document.querySelector('#pi [name=sysid]').validity.rangeOverflow")
        fill(page, "sysid", "9")
        assert violations(page) == []
        press(page, "Save")
        until(lambda: "sysid = 9" in pi.read("/etc/naze-bridge/page.toml"), "the saved setting")
        until(lambda: len(page.all("#pi details[open]")) == 1, "the refreshed panels")
        assert page.run("return [...document.querySelector('#pi [name=fc]').options].map((each) => each.value)") == [
            *("auto", "/dev/ttyAMA0")
        ]

        page.press("#pi [name='new_key']")
        press(page, "Show the changes")
        press(page, "Make these changes")
        page.wait_text("#pi", "The key, for ground stations")
        assert page.text("#pi .secret") == pi.read(KEY_FILE).strip()
        assert violations(page) == []

        web.board.set("unplug")  # type: ignore[union-attr]
        page.wait_text("#badges", "LOST")
        assert page.errors() == []


def test_a_setting_made_by_hand_cannot_be_changed(browsers: Browsers, bench: tuple[WebBench, FixablePi]) -> None:
    web, pi = bench
    pi.write("/etc/naze-bridge/config.toml", "sysid = 3\n")
    with browsers.tab(web.port, PHONE) as page:
        opened(page, web)
        unfold(page, "Settings of the bridge")
        page.wait_text("#pi", "Set by hand on the Pi: change it there.")
        assert page.find("#pi [name='sysid']").get_property("disabled")


def test_an_update_from_a_file(
    browsers: Browsers, bench: tuple[WebBench, FixablePi], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    web, pi = bench
    received: list[int] = []

    def receive(pi: object, size: int) -> str:
        received.append(size)
        return "9.9"

    monkeypatch.setattr("service.cli.helper.actions.receive", receive)
    package = packed(tmp_path)
    with browsers.tab(web.port, PHONE) as page:
        opened(page, web)
        unfold(page, "Update")
        page.wait_text("#pi", "built without a key")
    pi.write(SIGNERS, "naze-bridge ssh-ed25519 AAAA\n")
    with browsers.tab(web.port, PHONE) as page:
        opened(page, web)
        unfold(page, "Update")
        press(page, "Install")
        page.wait_text("#pi", "Choose a package first.")
        page.find("#pi input[type='file']").send_keys(str(package))
        press(page, "Install")
        page.wait_text("#pi", "Installing version 9.9.")
        assert received == [package.stat().st_size]
        assert violations(page) == []


def test_a_wrong_token(browsers: Browsers, bench: tuple[WebBench, FixablePi]) -> None:
    web, _ = bench
    with browsers.tab(web.port, PHONE) as page:
        page.open("pi")
        press(page, "Unlock with the token")
        page.enter_token("wrong")
        page.wait_text("#token-why", "This token is wrong.")
        page.find("#token").send_keys(web.token)
        page.press("#token-dialog button")
        page.wait_text("#pi", "Raspberry Pi 4 Model B, kite")
