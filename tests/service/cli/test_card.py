# SPDX-License-Identifier: GPL-3.0-or-later
"""A card freshly written by Raspberry Pi Imager gets one line and one folder, however often it is prepared.

tests/packaging/test_debian_package.py starts from such a card.
"""

import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from service.cli.main import main
from terminal import sentences
from tests.service.cli.helper.test_packages import packed
from tests.support.release_key import ReleaseKey

_SYSTEMD_RUN = "systemd.run=/boot/firstrun.sh systemd.run_success_action=reboot systemd.unit=kernel-command-line.target"
_FIRSTRUN = "#!/bin/bash\n\nset +e\n\necho kite >/etc/hostname\nrm -f /boot/firstrun.sh\nexit 0\n"
_USER_DATA = "#cloud-config\nhostname: kite\nusers:\n- name: pilot\n  shell: /bin/bash\n"


class Card:
    def __init__(self, folder: Path) -> None:
        self.boot = folder / "boot"
        self.boot.mkdir()
        for name, text in (("cmdline.txt", "console=tty1 rootwait"), ("config.txt", "[all]\n"), ("kernel8.img", "")):
            (self.boot / name).write_text(text)
        self.package = packed(folder, version="99.0", architecture="arm64")
        self.password = folder / "password"
        self.password.write_text("long-enough\n")

    def bookworm(self) -> None:
        (self.boot / "cmdline.txt").write_text(f"console=tty1 rootwait {_SYSTEMD_RUN}")
        (self.boot / "firstrun.sh").write_text(_FIRSTRUN)

    def trixie(self, more: str = "") -> None:
        (self.boot / "user-data").write_text(_USER_DATA + more)
        (self.boot / "network-config").write_text("network:\n  version: 2\n")

    def words(self, *options: str) -> tuple[str, ...]:
        files = ("--package", str(self.package), "--password-file", str(self.password))
        return ("card", str(self.boot), *files, "--hotspot", "pilot's kite", "--country", "de", *options)

    def prepare(self, *options: str) -> Result:
        return CliRunner().invoke(main, self.words(*options))


#: Runs the command without what Windows lacks.
_LIKE_WINDOWS = """
import os, socket, sys
for name in "fcntl", "grp", "pwd", "resource", "termios":
    sys.modules[name] = None
del os.geteuid, os.fork, socket.AF_UNIX
from service.cli.main import main
main(sys.argv[1:])
"""


@pytest.fixture
def card(tmp_path: Path) -> Card:
    return Card(tmp_path)


def test_bookworms_script_gets_a_line_and_works_as_before(card: Card) -> None:
    card.bookworm()
    done = card.prepare()
    assert done.exit_code == 0, done.output
    script = card.boot / "firstrun.sh"
    text = script.read_text()
    assert text.replace(text.splitlines(keepends=True)[1], "", 1) == _FIRSTRUN
    subprocess.run(["bash", "-n", script], check=True)
    assert (card.boot / "cmdline.txt").read_text().endswith(_SYSTEMD_RUN)


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ("", "\nruncmd:\n  - {}\n"),
        ("runcmd:\n- [rfkill, unblock, wifi]\n", "runcmd:\n- {}\n- [rfkill, unblock, wifi]\n"),
        (
            "runcmd:\n    # the pilot's\n    - ls\nssh_pwauth: true\n",
            "runcmd:\n    - {}\n    # the pilot's\n    - ls\nssh_",
        ),
    ],
)
def test_trixies_user_data_gets_a_command(card: Card, more: str, expected: str) -> None:
    card.trixie(more)
    assert card.prepare().exit_code == 0
    text = (card.boot / "user-data").read_text()
    assert expected.format("[sh, /boot/firmware/naze-bridge/enable.sh, start]") in text
    assert text.startswith(_USER_DATA)


def test_cloud_init_gives_the_pi_the_chosen_name(card: Card) -> None:
    card.trixie()
    assert card.prepare("--name", "heron").exit_code == 0
    assert "\nhostname: 'heron'\nusers:" in (card.boot / "user-data").read_text()


@pytest.mark.parametrize("system", [Card.bookworm, Card.trixie])
def test_it_may_be_prepared_again(card: Card, system: object) -> None:
    assert callable(system)
    system(card)
    card.prepare("--new-key", "--name", "kite")
    hooks = {path.name: path.read_text() for path in card.boot.glob("*") if path.is_file()}
    assert card.prepare("--name", "kite").exit_code == 0
    assert {path.name: path.read_text() for path in card.boot.glob("*") if path.is_file()} == hooks
    assert not (card.boot / "naze-bridge" / "key").exists()


def test_the_folder_has_the_package_the_answers_and_valid_scripts(card: Card, monkeypatch: pytest.MonkeyPatch) -> None:
    card.trixie()
    monkeypatch.setattr(sentences, "is_terminal", lambda: True)
    done = card.prepare("--new-key", "--name", "kite")
    folder = card.boot / "naze-bridge"
    assert (folder / "naze-bridge.deb").read_bytes() == card.package.read_bytes()
    assert (folder / "password").read_text() == "long-enough\n"
    key, token = ((folder / name).read_text().strip() for name in ("key", "web-token"))
    assert f": {key}" in done.output
    assert f": {token}" in done.output
    assert ": long-enough" in done.output
    monkeypatch.setattr(sentences, "is_terminal", lambda: False)
    captured = card.prepare("--new-key").output
    secrets = [(folder / name).read_text().strip() for name in ("key", "web-token", "password")]
    assert [secret for secret in secrets if secret in captured] == []
    (setup,) = (line for line in (folder / "first-boot.sh").read_text().splitlines() if " setup --yes" in line)
    words = shlex.split(setup)
    assert words[words.index("--hotspot") + 1] == "pilot's kite"
    assert words[words.index("--country") + 1] == "DE"
    assert words[words.index("--key-file") + 1] == "$here/key"
    for script in ("first-boot.sh", "enable.sh"):
        subprocess.run(["sh", "-n", folder / script], check=True)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda card: (card.boot / "config.txt").unlink(), "is not the boot partition"),
        (lambda card: card.package.unlink(), "cannot be read: No such file"),
        (lambda card: card.package.write_bytes(b""), "is not a Debian package (.deb), or it is damaged"),
        (lambda card: card.package.write_bytes(b"<html>"), "is not a Debian package"),
        (lambda card: card.package.write_bytes(card.package.read_bytes()[:-200]), "or it is damaged: fetch it again"),
        (
            lambda card: packed(card.boot.parent, architecture="amd64"),
            "is for amd64; this card needs the one for arm64",
        ),
        (
            lambda card: packed(card.boot.parent, architecture="armhf"),
            "is for armhf; this card needs the one for arm64",
        ),
        (lambda card: packed(card.boot.parent, name="other", version="99.0"), "is the package of other"),
        (lambda card: (card.boot / "user-data").unlink(), "Raspberry Pi Imager"),
        (lambda card: (card.boot / "user-data").write_text("x: 1\n"), "is not cloud-init's"),
        (lambda card: (card.boot / "user-data").write_text("#cloud-config\nruncmd: [ls]\n"), "list of lines"),
    ],
)
def test_another_folder_is_refused_and_left_as_it_is(card: Card, change: object, words: str) -> None:
    card.trixie()
    assert callable(change)
    change(card)
    before = sorted(card.boot.rglob("*"))
    done = card.prepare()
    assert done.exit_code == 1
    assert words in " ".join(done.output.split())
    assert sorted(card.boot.rglob("*")) == before


@pytest.mark.parametrize(
    ("kernels", "config", "accepted"),
    [
        (("kernel8.img", "kernel_2712.img"), "arm_64bit=1\n", {"arm64"}),
        (("kernel.img", "kernel7.img", "kernel7l.img", "kernel8.img"), "[all]\n", {"armhf"}),
        (("kernel7.img", "kernel8.img"), "arm_64bit=1\n", {"arm64", "armhf"}),
        ((), "", {"arm64", "armhf"}),
    ],
)
def test_the_cards_kernels_decide_the_architecture(
    card: Card, kernels: tuple[str, ...], config: str, accepted: set[str]
) -> None:
    card.trixie()
    (card.boot / "kernel8.img").unlink()
    for name in kernels:
        (card.boot / name).touch()
    (card.boot / "config.txt").write_text(config)
    for architecture in ("arm64", "armhf", "amd64"):
        packed(card.boot.parent, version="99.0", architecture=architecture)
        assert (card.prepare().exit_code == 0) is (architecture in accepted)


def test_a_signature_is_checked_if_the_package_has_one(card: Card, monkeypatch: pytest.MonkeyPatch) -> None:
    card.trixie()
    key = ReleaseKey(card.boot.parent / "key")
    monkeypatch.setattr("service.cli.card.SIGNERS", str(key.signers))
    assert "99.0 for arm64, complete, not signed." in card.prepare().output
    key.sign(card.package)
    assert "complete, signed by naze-bridge's releases." in card.prepare().output
    signed = card.package.read_bytes()
    card.package.write_bytes(signed.replace(b"2.0", b"3.0", 1))
    refused = card.prepare()
    assert refused.exit_code == 1
    assert "The signature of this package is wrong" in " ".join(refused.output.split())


def test_a_card_whose_first_start_failed_is_prepared_again(card: Card) -> None:
    card.bookworm()
    assert card.prepare().exit_code == 0
    (card.boot / "firstrun.sh").unlink()  # it ran
    (card.boot / "naze-bridge-RESULT.txt").write_text("naze-bridge is not set up")
    assert card.prepare("--name", "kite").exit_code == 0
    assert "--name kite" in (card.boot / "naze-bridge" / "first-boot.sh").read_text()
    assert not (card.boot / "naze-bridge-RESULT.txt").exists()


def test_wrong_answers_are_refused(card: Card) -> None:
    card.trixie()
    for options in (("--country", "Germany"), ("--name", "my pi"), ("--hotspot", "n" * 33)):
        assert card.prepare(*options).exit_code == 2


def test_a_card_is_prepared_on_windows_too(card: Card) -> None:
    card.trixie()
    done = subprocess.run([sys.executable, "-c", _LIKE_WINDOWS, *card.words()], capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert (card.boot / "naze-bridge" / "first-boot.sh").exists()
