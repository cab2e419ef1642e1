# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings made on the page: in their own file, below those written by hand, and each with a choice of values."""

import tomllib
from collections.abc import Mapping, Sequence

import pytest

from payloads.mission_data import Json
from service.cli.helper import page_settings
from service.cli.helper.action import HelperRefusal
from service.settings import SettingsError, load_settings
from service.settings.load import SERVICE_CONFIG
from service.settings.table import KEYS
from tests.support.fixable_pi import FixablePi

_PAGE = "/etc/naze-bridge/page.toml"


def page_file(pi: FixablePi) -> Json:
    return tomllib.loads(pi.read(_PAGE))


def shown(pi: FixablePi, name: str) -> Json:
    settings: list[Json] = pi.ask("overview")["settings"]
    (setting,) = (each for each in settings if each["name"] == name)
    return setting


def test_a_setting_is_written_and_the_bridge_restarted(pi: FixablePi) -> None:
    assert (shown(pi, "sysid")["value"], shown(pi, "sysid")["default"]) == (None, 1)
    pi.ask("settings", values={"sysid": 7, "record_tlog": False})
    assert page_file(pi) == {"sysid": 7, "record_tlog": False}
    assert any("restart naze-bridge.service" in command for command in pi.ran)
    assert load_settings(pi.path(SERVICE_CONFIG), state_dir=pi.root).sysid == 7
    assert (shown(pi, "sysid")["value"], shown(pi, "sysid")["elsewhere"]) == (7, None)


def test_null_is_the_default_again(pi: FixablePi) -> None:
    pi.ask("settings", values={"sysid": 7, "tlog_total_mb": 9})
    pi.ask("settings", values={"sysid": None})
    assert page_file(pi) == {"tlog_total_mb": 9}


_WRONG: Mapping[str, Sequence[object]] = {
    "sysid": (0, 256, "7", True, 7.0, [7], {}, "7\nfc = 1", 10**400),
    "log_level": ("loud", 'debug"\nfc="x', "", 7, ["debug"]),
    "record_tlog": (1, "true", 0.0),
}


@pytest.mark.parametrize("values", [{name: wrong} for name, values in _WRONG.items() for wrong in values])
def test_a_value_that_is_not_a_choice_is_refused(pi: FixablePi, values: Json) -> None:
    with pytest.raises(HelperRefusal, match="cannot have this value"):
        pi.ask("settings", values=values)
    assert not pi.path(_PAGE).exists()
    assert pi.ran == []


@pytest.mark.parametrize(
    "name", ["fc", "key_file", "gcs", "pass_through", "zenoh.config_file", "web.token_file", "", "a\nb"]
)
def test_files_addresses_and_rights_are_not_settings_of_the_page(pi: FixablePi, name: str) -> None:
    with pytest.raises(HelperRefusal, match="cannot change this setting"):
        pi.ask("settings", values={name: "/etc/shadow"})
    assert not pi.path(_PAGE).exists()


def test_settings_that_cannot_be_used_leave_the_file(pi: FixablePi, monkeypatch: pytest.MonkeyPatch) -> None:
    pi.ask("settings", values={"sysid": 7})
    before = pi.read(_PAGE)
    pi.ran.clear()
    monkeypatch.setattr(page_settings, "WriteFile", lambda *_: pytest.fail("it was written before it was tested"))
    pi.write(str(SERVICE_CONFIG), 'key_file = "nowhere"\n')
    with pytest.raises(SettingsError, match="nowhere cannot be read"):
        pi.ask("settings", values={"sysid": 8})
    assert pi.read(_PAGE) == before
    assert pi.ran == []


def test_handwritten_settings_win(pi: FixablePi) -> None:
    pi.write(str(SERVICE_CONFIG), "\nsysid = 3\n")
    assert shown(pi, "sysid")["elsewhere"] == "/etc/naze-bridge/config.toml:2"
    with pytest.raises(
        HelperRefusal, match=r"MAVLink system id is set in /etc/naze-bridge/config.toml:2, which overrides"
    ):
        pi.ask("settings", values={"sysid": 7})
    pi.write(_PAGE, "sysid = 7\n")
    assert load_settings(pi.path(SERVICE_CONFIG), state_dir=pi.root).sysid == 3


def test_odd_values_written_by_hand_are_shown_as_text(pi: FixablePi) -> None:
    pi.write(str(SERVICE_CONFIG), "sysid = 1979-05-27\n")
    assert shown(pi, "sysid")["value"] == "1979-05-27"


def test_every_setting_of_the_page_has_choices(pi: FixablePi) -> None:
    names = [each["name"] for each in pi.ask("overview")["settings"]]
    assert len(names) == 5
    assert all(key.reader.choices for key in KEYS if key.name in names)
