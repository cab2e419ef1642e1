# SPDX-License-Identifier: GPL-3.0-or-later
"""A machine for `naze-bridge setup`: its files are real, its programs are only recorded."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from service.cli.main import main
from service.cli.setup import command
from service.cli.setup.answers import KEY_FILE, SETTINGS_FILE
from service.cli.setup.change import Machine

_WANTED_BY = "etc/systemd/system/multi-user.target.wants"


class Pi:
    """A machine's files; programs are not run, but recorded."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = root
        self.ran: list[str] = []
        monkeypatch.setattr(command, "is_root", lambda: True)
        monkeypatch.setattr(command, "diagnose", lambda: True)
        monkeypatch.setattr(command, "_await_flight_controller", lambda: None)
        monkeypatch.setattr(Machine, "run", lambda _, words, *_args: self.ran.append(" ".join(words)))

    @property
    def key_file(self) -> Path:
        return self.root / KEY_FILE.lstrip("/")

    def is_running(self) -> None:
        (self.root / "run/systemd/system").mkdir(parents=True)
        (self.root / "sys/class/net/wlan0/wireless").mkdir(parents=True)
        (self.root / _WANTED_BY).mkdir(parents=True)
        (self.root / _WANTED_BY / "naze-bridge.service").symlink_to("x")

    def settings(self) -> dict[str, Any]:
        return tomllib.loads((self.root / SETTINGS_FILE.lstrip("/")).read_text())

    def files(self) -> dict[str, str]:
        found = (path for path in self.root.rglob("*") if path.is_file())
        return {str(path.relative_to(self.root)): path.read_text() for path in found}

    def setup(self, *options: str, answers: str = "") -> Result:
        return CliRunner().invoke(main, ["setup", "--root", str(self.root), *options], input=answers)
