# SPDX-License-Identifier: GPL-3.0-or-later
"""Setup and the signing key: a new one is stored and shown once, a weak one is warned of."""

import io
import re
import tomllib
from pathlib import Path

import click
import pytest
import segno
from click.testing import CliRunner, Result

from service.cli.main import main
from service.cli.setup import command
from service.cli.setup.answers import KEY_FILE, SETTINGS_FILE
from service.cli.setup.command import check_answers, page_token
from service.settings.passphrase import weakness
from terminal import sentences
from tests.service.cli.setup.test_steps import FreshPi
from tests.support.setup_pi import Pi

_SHOWN = re.compile(r"^The key, .*: (\S+)$", re.MULTILINE)
_WANTED_BY = "etc/systemd/system/multi-user.target.wants"


@pytest.fixture(autouse=True)
def at_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sentences, "is_terminal", lambda: True)


def shown_key(done: Result) -> str:
    assert done.exit_code == 0, done.output
    (key,) = _SHOWN.findall(done.output)
    return str(key)


def test_a_new_key_is_stored_for_the_service_and_shown_with_the_code(pi: Pi) -> None:
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
    assert settings["key_file"] == KEY_FILE
    assert key not in pi.setup("--yes").output


def test_the_pilot_is_asked_once(pi: Pi) -> None:
    hotspot, page, key, go = "n\n", "y\n", "y\n", "y\n"
    first = shown_key(pi.setup(answers=hotspot + page + key + go))
    again = pi.setup(answers=go)
    assert again.exit_code == 0, again.output
    assert again.output.count("?") == 1  # Make these changes?
    before = "Already set up: flight controller auto, status page on, a key is required"
    assert before in again.output
    assert before in pi.setup("--dry-run", "--no-page").output
    assert pi.key_file.read_text() == f"{first}\n"


def test_a_new_key_replaces_the_present_and_the_service_takes_it(pi: Pi) -> None:
    pi.is_running()
    first = shown_key(pi.setup("--yes", "--new-key"))
    pi.ran.clear()
    second = shown_key(pi.setup("--yes", "--new-key"))
    assert pi.key_file.read_text() == f"{second}\n" != f"{first}\n"
    assert pi.ran[-1] == "systemctl restart naze-bridge.service"


def test_captured_output_is_free_of_secrets(pi: Pi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sentences, "is_terminal", lambda: False)
    state, password = pi.root / "var/lib/naze-bridge", tmp_path / "password"
    state.mkdir(parents=True)
    (state / "web-token").write_text("2345-6789-abcd\n")
    password.write_text("long-enough\n")
    done = pi.setup("--yes", "--new-key", "--hotspot", "kite", "--password-file", str(password))
    assert done.exit_code == 0, done.output
    secrets = pi.key_file.read_text().strip(), "2345-6789-abcd", "long-enough"
    assert [secret for secret in secrets if secret in done.output] == []
    assert f"The key, for ground stations that may make changes: in {KEY_FILE}" in done.output
    assert "Its token, for changes: in /var/lib/naze-bridge/web-token" in done.output


def test_the_token_is_shown_with_the_code(pi: Pi) -> None:
    root = ["token", "--root", str(pi.root)]
    assert "no token yet" in CliRunner().invoke(main, root).output
    (pi.root / "var/lib/naze-bridge").mkdir(parents=True)
    (pi.root / "var/lib/naze-bridge/web-token").write_text("2345-6789-abcd\n")
    shown = CliRunner().invoke(main, root).output
    assert "Its token, for changes: 2345-6789-abcd" in shown
    assert "▄" in shown


def test_a_dry_run_shows_and_does_not_make_a_key(pi: Pi) -> None:
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


@pytest.mark.parametrize(
    "password",
    [
        "12345678\n[ipv4]\nmethod=auto",
        "1234567",
        "12345678\r",
        "1234\0005678",
        "1234\x1b5678",
        "ü2345678",
        "1" * 64,
        "",
    ],
)
def test_an_invalid_password_is_refused(password: str) -> None:
    with pytest.raises(click.UsageError, match="8 to 63 letters"):
        check_answers("kite", password, "DE", None)


@pytest.mark.parametrize("name", ["", "n" * 33, "ü" * 17, "a\nb", "a\0b", "a\x1bb", "\ud800", "a\u202eb"])
def test_an_invalid_network_name_is_refused(name: str) -> None:
    with pytest.raises(click.UsageError, match="not a network name"):
        check_answers(name, "long-enough", "DE", None)


@pytest.mark.parametrize(
    "text", [b"two\nlines\n", b" long-enough\n", b"long-enough \n", b"long\x1benough", b"\xff", b""]
)
def test_a_file_that_does_not_hold_a_single_line_is_refused(pi: Pi, tmp_path: Path, text: bytes) -> None:
    (tmp_path / "password").write_bytes(text)
    assert pi.setup("--yes", "--hotspot", "kite", "--password-file", str(tmp_path / "password")).exit_code == 2


def test_everything_is_printed_before_the_wifi_changes(pi: Pi, tmp_path: Path) -> None:
    pi.is_running()
    password = tmp_path / "password"
    password.write_text("long-enough\n")
    done = pi.setup("--hotspot", "kite", "--password-file", str(password), answers="y\n" * 3 + "\n")
    assert done.exit_code == 0, done.output
    order = ["Status page:", "The key, ", "Now the Wi-Fi changes to the hotspot 'kite'", "Press Enter"]
    places = [done.output.index(words) for words in order]
    assert places == sorted(places)
    # Closing the terminal must not leave it half done: another process opens it.
    assert pi.ran[-1].startswith("systemd-run ")
    assert not [command for command in pi.ran if "connection up" in command]


def test_wrong_options_are_refused_before_the_questions(pi: Pi, tmp_path: Path) -> None:
    done = pi.setup("--country", "Germany", answers="y\n" * 9)
    assert done.exit_code == 2
    assert "'Germany' is not a country code" in done.output
    assert "?" not in done.output.partition("Error")[0].partition("Usage")[0]
    pi.is_running()
    (pi.root / "sys/class/net/wlan0/wireless").rmdir()
    (tmp_path / "password").write_text("long-enough\n")
    done = pi.setup("--yes", "--hotspot", "kite", "--password-file", str(tmp_path / "password"))
    assert "no Wi-Fi card" in done.output
    assert pi.files().keys() & {"etc/naze-bridge/setup.toml"} == set()


def test_doctors_verdict_does_not_keep_the_hotspot_closed(
    pi: Pi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "diagnose", lambda: False)
    pi.is_running()
    password = tmp_path / "password"
    password.write_text("long-enough\n")
    done = pi.setup("--yes", "--hotspot", "kite", "--password-file", str(password))
    assert done.exit_code == 1
    assert pi.ran[-1].startswith("systemd-run ")


def test_a_reboot_is_requested_once_the_console_left_the_uart(pi: Pi) -> None:
    for path, text in (
        ("proc/device-tree/model", "Raspberry Pi 4 Model B Rev 1.4\0"),
        ("boot/firmware/cmdline.txt", "console=serial0,115200 console=tty1 rootwait\n"),
        ("boot/firmware/config.txt", "[all]\nenable_uart=1\n"),
    ):
        (pi.root / path).parent.mkdir(parents=True, exist_ok=True)
        (pi.root / path).write_text(text)
    done = pi.setup("--yes")
    assert done.exit_code == 0, done.output
    assert "sudo reboot" in done.output
    assert "sudo reboot" not in pi.setup("--yes").output


def test_the_pages_token_is_shown_only_if_it_is_valid(tmp_path: Path) -> None:
    """The service, which writes the file, may have been taken over; setup prints it on root's terminal."""
    pi = FreshPi(tmp_path, "4")
    token = pi.write("/var/lib/naze-bridge/web-token", "2345-6789-abcd\n")
    assert page_token(pi) == "2345-6789-abcd"
    token.write_text("2345\x1b[2J6789")
    assert page_token(pi) == ""
    token.unlink()
    token.symlink_to(pi.write("/root/secret", "secret"))
    assert page_token(pi) == ""
