# SPDX-License-Identifier: GPL-3.0-or-later
"""Remedies are applied as printed, and then the check finds no problem."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from service.cli.doctor.checked import Checked, Grade
from service.cli.doctor.flight_controller import check_flight_controller
from service.cli.doctor.network import check_keys
from service.cli.doctor.port import check_console, check_port
from service.settings import Settings, load_settings
from service.settings.addresses import SerialFc
from tests.support.doctor import STATUS
from tests.support.faulty_machine import PORT, FaultyMachine
from tests.support.setup_pi import Pi

_CONFIG = "etc/naze-bridge/config.toml"


@pytest.fixture
def setup_pi(pi: FaultyMachine, monkeypatch: pytest.MonkeyPatch) -> Pi:
    return Pi(pi.root, monkeypatch)


def run_in(root: Path, remedy: str) -> None:
    """Run the shell words of a remedy on the files below `root`."""
    words = remedy.partition(";")[0].replace("&& sudo reboot", "").replace("sudo ", "")
    subprocess.run(re.sub(r" (/\S+)", rf" {root}\1", words), shell=True, check=True)  # noqa: S602


def settings_of(setup_pi: Pi) -> Settings:
    config = setup_pi.root / _CONFIG
    config.parent.mkdir(parents=True, exist_ok=True)
    config.touch()
    return load_settings(config, state_dir=setup_pi.root)


def setup_by(setup_pi: Pi, remedy: str) -> None:
    (words,) = re.findall(r"sudo naze-bridge setup (--[^;]*)", remedy)
    done = setup_pi.setup("--yes", *words.split(" makes ")[0].split())
    assert done.exit_code == 0, done.output


def test_a_console_in_cmdline_txt(pi: FaultyMachine) -> None:
    pi.write("/boot/firmware/cmdline.txt", "console=serial0,115200 console=tty1 rootwait\n")
    found = check_console(pi, PORT)
    assert found is not None
    run_in(pi.root, found.remedy)
    assert pi.read("/boot/firmware/cmdline.txt") == "console=tty1 rootwait\n"
    fixed = check_console(pi, PORT)
    assert fixed is not None
    assert fixed.grade is Grade.OK


def missing_port(pi: FaultyMachine, settings: Settings) -> Checked:
    return check_port(pi, settings.fc, settings.sources.get("fc", ""))


def wrong_speed(pi: FaultyMachine, settings: Settings) -> Checked:
    silent = STATUS | {"flight_controller": None, "state": "searching", "fc_bytes_received": 5000}
    # At its own speed the board answers.
    running = silent if settings.fc == SerialFc("/dev/ttyUSB0", 9600) else STATUS
    return check_flight_controller(settings.fc, running, None, settings.sources.get("fc", ""))[1]


@pytest.mark.parametrize(("fc", "check"), [("/dev/ttyUSB7", missing_port), ("/dev/ttyUSB0,9600", wrong_speed)])
@pytest.mark.parametrize("place", ["setup", _CONFIG])
def test_a_wrong_fc_wherever_it_is_set(
    pi: FaultyMachine, setup_pi: Pi, fc: str, check: Callable[[FaultyMachine, Settings], Checked], place: str
) -> None:
    pi.write("/dev/ttyUSB0")
    pi.path("/dev/serial0").unlink()
    if place == "setup":
        assert setup_pi.setup("--yes", "--fc", fc).exit_code == 0
    else:
        pi.write(place, f'sysid = 2\nfc = "{fc}"\n')
    found = check(pi, settings_of(setup_pi))
    assert found.grade is Grade.PROBLEM
    if place == "setup":
        setup_by(setup_pi, found.remedy)
    else:
        line, file, number = re.findall(r"write (.*) in (.*):(\d+) ", found.remedy)[0]
        lines = Path(file).read_text().splitlines()
        lines[int(number) - 1] = line
        Path(file).write_text("\n".join(lines))
    assert check(pi, settings_of(setup_pi)).grade is Grade.OK


def test_a_weak_key(pi: FaultyMachine, setup_pi: Pi, tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text("x\n")
    setup_pi.setup("--yes", "--key-file", str(file))

    def checked() -> Checked:
        answers = setup_pi.root / "etc/naze-bridge/setup.toml"
        answers.write_text(answers.read_text().replace('"/etc', f'"{setup_pi.root}/etc'))
        settings = settings_of(setup_pi)
        (found,) = check_keys(settings.gcs, settings.access)
        return found

    found = checked()
    assert found.grade is Grade.NOTE
    assert "setup --new-key" in found.remedy
    assert setup_pi.setup("--yes", "--new-key").exit_code == 0
    assert checked().grade is Grade.OK
