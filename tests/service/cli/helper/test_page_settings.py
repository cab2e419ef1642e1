# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings made on the page: in their own file, below those written by hand."""

import tomllib
from typing import Any

import pytest

from service.cli.helper.action import HelperRefusal
from service.cli.helper.page_settings import toml_text
from service.settings import SettingsError, load_settings
from service.settings.load import SERVICE_CONFIG
from tests.support.fixable_pi import FixablePi

_PAGE = "/etc/naze-bridge/page.toml"


def page_file(pi: FixablePi) -> dict[str, Any]:
    return tomllib.loads(pi.read(_PAGE))


def test_a_setting_is_written_and_the_bridge_restarted(pi: FixablePi) -> None:
    pi.ask("settings", values={"sysid": "7", "web.listen": '"0.0.0.0:8081"'})
    assert page_file(pi) == {"sysid": 7, "web": {"listen": "0.0.0.0:8081"}}
    assert any("restart naze-bridge.service" in command for command in pi.ran)
    settings = load_settings(pi.path(SERVICE_CONFIG), state_dir=pi.root)
    assert settings.sysid == 7
    assert settings.web is not None
    assert settings.web.listen.port == 8081
    shown = pi.ask("overview")["settings"]
    assert shown["sysid"] == {"text": "7", "where": f"{_PAGE}:2"}


def test_a_live_setting_is_taken_over_without_a_restart(pi: FixablePi) -> None:
    pi.ask("settings", values={"log_level": '"debug"'})
    assert pi.ran == ["systemctl reload naze-bridge.service"]


def test_null_is_the_default_again(pi: FixablePi) -> None:
    pi.ask("settings", values={"sysid": "7", "tlog_days": "9"})
    pi.ask("settings", values={"sysid": None})
    assert page_file(pi) == {"tlog_days": 9}
    pi.ask("undo")
    assert page_file(pi) == {"sysid": 7, "tlog_days": 9}


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"sysid": "900"}, "sysid is 900"),
        ({"tlog_total_mb": "3"}, "tlog_total_mb is 3"),
        ({"fc": '"tcp:"'}, "tcp:"),
    ],
)
def test_settings_that_cannot_be_used_leave_the_file(pi: FixablePi, values: dict[str, str], why: str) -> None:
    pi.ask("settings", values={"sysid": "7"})
    before = pi.read(_PAGE)
    pi.ran.clear()
    with pytest.raises(SettingsError, match=why):
        pi.ask("settings", values=values)
    assert pi.read(_PAGE) == before
    assert pi.ran == []


@pytest.mark.parametrize(
    "text", ["", "word", "1\nsysid = 2", '"a', 7, ["a"], "x" * 5000, "{a = 1", "1979-05-27x", "[" * 900]
)
def test_what_is_no_value_is_refused(pi: FixablePi, text: object) -> None:
    with pytest.raises(HelperRefusal, match="sysid: this is no value"):
        pi.ask("settings", values={"sysid": text})
    assert not pi.path(_PAGE).exists()


def test_only_the_value_is_written(pi: FixablePi) -> None:
    pi.ask("settings", values={"sysid": "1 # a comment"})
    assert pi.read(_PAGE).splitlines()[1:] == ["sysid = 1"]


def test_an_unknown_name(pi: FixablePi) -> None:
    with pytest.raises(HelperRefusal, match="'speed' is not a setting"):
        pi.ask("settings", values={"speed": "1"})


def test_what_was_written_by_hand_wins(pi: FixablePi) -> None:
    pi.write(str(SERVICE_CONFIG), "\nsysid = 3\n")
    with pytest.raises(HelperRefusal, match=r"sysid is set in /etc/naze-bridge/config.toml:2, which overrides"):
        pi.ask("settings", values={"sysid": "7"})
    pi.write(_PAGE, "sysid = 7\n")
    assert load_settings(pi.path(SERVICE_CONFIG), state_dir=pi.root).sysid == 3


@pytest.mark.parametrize(
    "value", [7, -1, True, 'a "quoted" \\ ü', [], ["a", "b"], [{"address": "tcpin:1:2", "write": False}]]
)
def test_values_as_in_the_file(value: object) -> None:
    assert tomllib.loads(f"x = {toml_text(value)}") == {"x": value}
