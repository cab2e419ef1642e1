# SPDX-License-Identifier: GPL-3.0-or-later
"""Setup and the signing key: a new one is stored and shown once, a weak one is warned of."""

import io
import re
import tomllib
from pathlib import Path

import pytest
import segno
from click.testing import CliRunner, Result

from service.cli.main import main
from service.cli.setup import command
from service.cli.setup.change import Machine
from service.cli.setup.steps import KEY_FILE, SETTINGS_FILE
from service.settings.passphrase import weakness

_SHOWN = re.compile(r"^The key, .*: (\S+)$", re.MULTILINE)
_WANTED_BY = "etc/systemd/system/multi-user.target.wants"


class Pi:
    """A machine's files; programs are not run, but recorded."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = root
        self.ran: list[str] = []
        monkeypatch.setattr(command, "is_root", lambda: True)
        monkeypatch.setattr(command, "diagnose", lambda: True)
        monkeypatch.setattr(command, "_await_flight_controller", lambda: None)
        monkeypatch.setattr(Machine, "run", lambda _, words: self.ran.append(" ".join(words)))

    @property
    def key_file(self) -> Path:
        return self.root / KEY_FILE.lstrip("/")

    def is_running(self) -> None:
        (self.root / "run/systemd/system").mkdir(parents=True)
        (self.root / _WANTED_BY).mkdir(parents=True)
        (self.root / _WANTED_BY / "naze-bridge.service").symlink_to("x")

    def setup(self, *options: str, answers: str = "") -> Result:
        return CliRunner().invoke(main, ["setup", "--root", str(self.root), *options], input=answers)


@pytest.fixture
def pi(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pi:
    return Pi(tmp_path, monkeypatch)


def shown_key(done: Result) -> str:
    assert done.exit_code == 0, done.output
    (key,) = _SHOWN.findall(done.output)
    return str(key)


def test_a_new_key_is_stored_for_the_service_and_shown_with_its_code(pi: Pi) -> None:
    done = pi.setup("--yes", "--new-key")
    key = shown_key(done)
    assert weakness(key) is None
    assert pi.key_file.read_text() == f"{key}\n"
    assert pi.key_file.stat().st_mode & 0o777 == 0o600
    assert f"chown naze-bridge: {KEY_FILE}" in pi.ran
    code = io.StringIO()
    segno.make(key, error="l").terminal(code, compact=True)
    assert code.getvalue() in done.output
    settings = tomllib.loads((pi.root / SETTINGS_FILE.lstrip("/")).read_text())
    assert settings["gcs"][0]["key_file"] == KEY_FILE
    assert key not in pi.setup("--yes").output


def test_the_pilot_is_asked_for_a_key_until_there_is_one(pi: Pi) -> None:
    hotspot, page, key, go = "n\n", "y\n", "y\n", "y\n"
    first = shown_key(pi.setup(answers=hotspot + page + key + go))
    again = pi.setup(answers=hotspot + page + go)
    assert again.exit_code == 0, again.output
    assert "Make a key" not in again.output
    assert pi.key_file.read_text() == f"{first}\n"


def test_a_new_key_replaces_the_present_one_and_the_service_takes_it(pi: Pi) -> None:
    pi.is_running()
    first = shown_key(pi.setup("--yes", "--new-key"))
    pi.ran.clear()
    second = shown_key(pi.setup("--yes", "--new-key"))
    assert pi.key_file.read_text() == f"{second}\n" != f"{first}\n"
    assert pi.ran[-1] == "systemctl restart naze-bridge.service"


def test_a_dry_run_shows_and_makes_no_key(pi: Pi) -> None:
    done = pi.setup("--dry-run", "--new-key")
    assert "set the key" in done.output
    assert not _SHOWN.findall(done.output)
    assert not pi.key_file.exists()


def test_a_weak_key_is_used_with_a_warning(pi: Pi, tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text("x\n")
    done = pi.setup("--yes", "--key-file", str(file))
    assert (done.exit_code, pi.key_file.read_text()) == (0, "x\n")
    assert "the key is weak" in done.output
    assert "setup --new-key" in done.output
    assert "the key is weak" in pi.setup("--yes").output


def test_an_empty_key_and_two_keys_are_refused(pi: Pi, tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text("\n")
    for options in (["--key-file", str(file)], ["--key-file", str(file), "--new-key"]):
        assert pi.setup("--yes", *options).exit_code == 2
    file.write_text("x\n")
    assert "either" in pi.setup("--yes", "--key-file", str(file), "--new-key").output
    assert not pi.key_file.exists()
