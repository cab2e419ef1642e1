# SPDX-License-Identifier: GPL-3.0-or-later
"""Planned changes: shown first, and not repeated in a second run."""

import tomllib
from pathlib import Path

from service.cli.setup.answers import SETTINGS_FILE, SetupChoices
from service.cli.setup.steps import missing_steps
from tests.service.cli.setup.test_steps import CMDLINE, CONFIG, MODELS, FreshPi
from tests.support.programs import run_naze_bridge


def test_a_second_run_keeps_the_key_and_the_hotspot(tmp_path: Path, model: str) -> None:
    pi = FreshPi(tmp_path, model)
    pi.carry_out(missing_steps(pi, SetupChoices(key="secret words")))
    (step,) = missing_steps(pi, SetupChoices(page=False))[:1]
    pi.carry_out(missing_steps(pi, SetupChoices(page=False)))
    assert step.purpose == "save the settings"
    settings = tomllib.loads(pi.read(SETTINGS_FILE))
    assert "web" not in settings
    assert "key_file" in settings
    assert "systemctl restart naze-bridge.service" in pi.ran


def test_an_enabled_getty_is_disabled(tmp_path: Path) -> None:
    pi = FreshPi(tmp_path, "4")
    pi.write(CMDLINE, "console=tty1 rootwait\n")
    wants = pi.path("/etc/systemd/system/getty.target.wants")
    wants.mkdir(parents=True)
    (wants / "serial-getty@ttyS0.service").symlink_to("x")
    (console, *_) = missing_steps(pi, SetupChoices())
    assert not console.needs_reboot
    pi.carry_out([console])
    assert pi.ran == ["systemctl disable --now serial-getty@ttyS0.service"]


def test_the_command_shows_the_planned_changes(tmp_path: Path, model: str) -> None:
    pi = FreshPi(tmp_path, model)
    ended = run_naze_bridge("setup", "--dry-run", "--root", tmp_path)
    assert ended.returncode == 0, ended
    assert ended.stdout.startswith(f"This is a {MODELS[model][0]}.")
    assert f"write {CONFIG}" in ended.stdout
    assert MODELS[model][2] not in pi.read(CONFIG)
    assert [line for line in ended.stdout.splitlines() if len(line) > 80 and not line.startswith(" " * 7)] == []
