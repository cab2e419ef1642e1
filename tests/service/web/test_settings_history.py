# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings on the page: what changed, what a restore would change, restoring, and the declination of the place."""

from typing import Any

import pytest

from protocols.param_file import read_param_file
from tests.support.chromium import PHONE, Browsers
from tests.support.programs import run_naze_bridge, until
from tests.support.web_bench import WebBench

pytest_plugins = ("tests.support.web_fixtures",)


def command(bench: WebBench, *words: str) -> str:
    ended = run_naze_bridge("settings", *words, "--state-dir", bench.daemon.state_dir)
    assert ended.returncode == 0, ended
    return ended.stdout.strip()


def backups(bench: WebBench) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = bench.ask("/api/settings").data["backups"]
    return found


@pytest.fixture
def tuned(web: WebBench) -> WebBench:
    """Two backups: as met, and with another p_roll."""
    until(lambda: len(backups(web)) == 1, "the first backup")
    command(web, "set", "p_roll", "44")
    command(web, "save")
    until(lambda: len(backups(web)) == 2, "the second backup")
    return web


def test_a_backup_shows_its_changes_and_the_effect_of_a_restore(tuned: WebBench) -> None:
    newest, first = (tuned.ask(f"/api/settings/{number}").data for number in (2, 1))
    assert newest["changes"] == [{"name": "p_roll", "left": 35, "right": 44}]
    assert (newest["before"], newest["plan"]["changes"]) == (1, [])
    assert first["before"] is None
    assert first["plan"]["changes"] == [{"name": "p_roll", "was": 44, "becomes": 35}]
    file = tuned.ask("/api/settings/1/file")
    assert "settings-1.param" in file.headers["Content-Disposition"]
    assert read_param_file(file.body, "x").values["P_ROLL"] == 35
    assert tuned.state()["newest_backup"] == 2


def test_a_restore_needs_the_token(tuned: WebBench) -> None:
    assert tuned.ask("/api/settings/1/restore", "POST").status == 401
    assert tuned.ask("/api/settings/1/restore", "POST", Authorization="Bearer wrong").status == 401
    assert tuned.ask("/api/settings/1/restore").status == 405
    for wrong in ("99", "x", "-1", "9" * 30):
        answer = tuned.ask(f"/api/settings/{wrong}/restore", "POST", Authorization=f"Bearer {tuned.token}")
        assert answer.status == 404
    assert command(tuned, "get", "p_roll") == "44"


_FIRST = "#settings details[data-number='1']"


def test_a_backup_is_restored_from_the_page(browsers: Browsers, tuned: WebBench) -> None:
    with browsers.tab(tuned.port, PHONE) as page:
        page.open("check", tuned.token)
        page.unfold("#settings-block")
        page.wait_text("#settings", "connected")
        page.unfold(_FIRST)
        page.wait_text(_FIRST, "Restoring would change")
        page.wait_text(_FIRST, "p_roll")
        assert page.run("return window.innerWidth") == PHONE[0]
        page.press(f"{_FIRST} button.write")
        page.wait_text(f"{_FIRST} .result", "1 setting restored, saved and verified")
        until(lambda: len(backups(tuned)) == 3, "the backup after the restore")
        assert command(tuned, "get", "p_roll") == "35"
        page.wait_text("#settings", "1 of 201")
        assert tuned.board is not None
        tuned.board.set("armed 1")
        until(lambda: page.text("#badges") == "ARMED", "the armed craft")
        assert not page.find(f"{_FIRST} button.write").is_enabled()


@pytest.fixture
def misaligned(web: WebBench) -> WebBench:
    """The simulated craft is where the declination is 3 degrees east."""
    assert web.state()["declination"] is None
    assert web.ask("/api/declination", "POST", Authorization=f"Bearer {web.token}").status == 404
    command(web, "set", "mag_dec", "-2548")
    until(lambda: web.state()["declination"], "the finding")
    return web


def test_a_wrong_declination_is_in_the_state_and_its_button_needs_the_token(misaligned: WebBench) -> None:
    assert misaligned.state()["declination"] == [29, "mag_dec", 300]
    assert misaligned.ask("/api/declination", "POST").status == 401
    shown = run_naze_bridge("status", "--state-dir", misaligned.daemon.state_dir).stdout
    assert "29 deg off at this place: naze-bridge settings set mag_dec 300 && naze-bridge settings save" in shown
    assert misaligned.board is not None
    misaligned.board.set("armed 1")
    until(lambda: misaligned.state()["status"]["armed"], "the armed craft")
    answer = misaligned.ask("/api/declination", "POST", Authorization=f"Bearer {misaligned.token}")
    assert answer.status == 202
    write = until(lambda: (now := misaligned.state()["write"])["done"] and now, "the refusal")
    assert (write["ok"], write["text"][:5]) == (False, "Armed")
    misaligned.board.set("armed 0")
    until(lambda: misaligned.state()["status"]["armed"] is False, "the disarmed craft")
    assert command(misaligned, "get", "mag_dec") == "-2548"


def test_one_button_sets_and_saves_the_declination(browsers: Browsers, misaligned: WebBench) -> None:
    with browsers.tab(misaligned.port, PHONE) as page:
        page.open("fly", misaligned.token)
        page.wait_text("#declination", "The declination is 29° off at this place.")
        page.press("#declination button.write")
        page.wait_text("#declination .result", "1 setting restored, saved and verified")
        until(lambda: not page.find("#declination button").is_displayed(), "the end of the finding")
        assert command(misaligned, "get", "mag_dec") == "300"
        assert page.errors() == []
