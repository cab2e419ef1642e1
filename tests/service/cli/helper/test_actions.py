# SPDX-License-Identifier: GPL-3.0-or-later
"""The helper's actions on a machine made of files."""

import pytest

from service.cli.helper.action import HelperRefusal
from service.cli.setup.answers import KEY_FILE, SETTINGS_FILE
from service.cli.setup.hotspot import hotspot_name
from service.machine.host import Host
from tests.support.fixable_pi import FixablePi

_HOTSPOT = {"hotspot": "kite", "password": "long-enough", "country": "de"}


def test_the_first_questions(pi: FixablePi) -> None:
    assert not pi.ask("overview")["is_set_up"]
    answers = {**_HOTSPOT, "name": "bird", "new_key": True}
    trial = pi.ask("answer", is_trial=True, **answers)
    assert not pi.path(SETTINGS_FILE).exists()
    assert trial["key"] is None
    made = pi.ask("answer", **answers)
    assert made["steps"] == trial["steps"]
    assert made["cuts_network"]
    assert pi.read(KEY_FILE) == f"{made['key']}\n"
    overview = pi.ask("overview")
    assert {name: overview[name] for name in ("is_set_up", "has_key", "hotspot")} == {
        "is_set_up": True,
        "has_key": True,
        "hotspot": "kite",
    }
    assert "long-enough" not in str(made)


def test_the_bridge_restarts_only_after_the_reply(pi: FixablePi) -> None:
    pi.ask("answer", fc="/dev/ttyAMA0")
    (restart,) = [command for command in pi.ran if "restart naze-bridge.service" in command]
    assert restart.startswith("systemd-run")
    assert "--on-active=2" in restart


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"fc": "/dev/ttyAMA7"}, "no such port"),
        ({"fc": "/etc/shadow"}, "no such port"),
        ({"fc": "tcp:elsewhere:1"}, "no such port"),
        ({"hotspot": "kite"}, "a name and a password"),
    ],
)
def test_invalid_answers_have_no_effect(pi: FixablePi, wrong: dict[str, str], why: str) -> None:
    with pytest.raises(HelperRefusal, match=why):
        pi.ask("answer", **wrong)
    assert not pi.path(SETTINGS_FILE).exists()


def test_the_hotspot_is_switched(pi: FixablePi) -> None:
    with pytest.raises(HelperRefusal, match="needs no change any more"):
        pi.ask("fix", fix="open the hotspot")
    pi.ask("answer", **_HOTSPOT)
    assert hotspot_name(pi) == "kite"
    assert pi.ask("fix", fix="close the hotspot")["cuts_network"]
    assert pi.ran[-1].endswith("-m service.cli.setup.hotspot close")
    pi.ask("fix", fix="open the hotspot")
    assert pi.ran[-1].endswith("-m service.cli.setup.hotspot")


def test_only_serial_ports_of_this_pi_are_offered(pi: FixablePi, monkeypatch: pytest.MonkeyPatch) -> None:
    assert pi.ask("overview")["ports"] == ["auto", "/dev/ttyAMA0"]
    monkeypatch.setattr(FixablePi, "is_tty", Host.is_tty)  # the port is only a file
    assert pi.ask("overview")["ports"] == ["auto"]


def test_a_downgrade_needs_an_earlier_update(pi: FixablePi) -> None:
    with pytest.raises(HelperRefusal, match="No earlier version"):
        pi.ask("downgrade")


def test_a_package_of_an_impossible_size(pi: FixablePi) -> None:
    with pytest.raises(HelperRefusal, match="at most 128 MB"):
        pi.ask("install", size=1 << 40)


def test_requests_are_free_of_commands_paths_and_processes(pi: FixablePi) -> None:
    for fix in ("kill 1", "rm -rf /", "", "stop the program with pid 1", "restart the Pi", "restart the bridge\n"):
        with pytest.raises(HelperRefusal):
            pi.ask("fix", fix=fix)
    assert pi.ran == []
