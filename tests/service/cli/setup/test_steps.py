# SPDX-License-Identifier: GPL-3.0-or-later
"""Setup on each Raspberry Pi model, under a root of files: its changes, and no changes in a second run."""

import re
import tomllib
from pathlib import Path

import pytest

from service.cli.setup.answers import SETTINGS_FILE, SetupChoices, settings_text
from service.cli.setup.change import Machine, Run, Step, WriteFile
from service.cli.setup.hotspot import hotspot_name
from service.cli.setup.steps import missing_steps
from tests.support.faulty_machine import FaultyMachine

#: Model, target of /dev/serial0, the console's name in Raspberry Pi OS, and the line needed in config.txt.
MODELS = {
    "3": ("Raspberry Pi 3 Model B Plus Rev 1.3", "ttyS0", "enable_uart=1"),
    "4": ("Raspberry Pi 4 Model B Rev 1.4", "ttyS0", "enable_uart=1"),
    "5": ("Raspberry Pi 5 Model B Rev 1.0", "ttyAMA10", "dtparam=uart0=on"),
    "Zero 2 W": ("Raspberry Pi Zero 2 W Rev 1.0", "ttyS0", "enable_uart=1"),
}
CMDLINE, CONFIG = "/boot/firmware/cmdline.txt", "/boot/firmware/config.txt"
HOTSPOT = "/etc/NetworkManager/system-connections/naze-bridge-hotspot.nmconnection"


class FreshPi(FaultyMachine):
    """Freshly flashed Raspberry Pi OS with the package installed."""

    def __init__(self, root: Path, model: str) -> None:
        super().__init__(root)
        name, serial0, _ = MODELS[model]
        self.write("/proc/device-tree/model", f"{name}\0")
        self.path("/dev/serial0").unlink()
        self.path("/dev/serial0").symlink_to(serial0)
        self.write(CMDLINE, "console=serial0,115200 console=tty1 root=PARTUUID=1-02 rootwait\n")
        self.write(CONFIG, "dtparam=audio=on\n[cm4]\notg_mode=1\n[all]\n")
        self.write("/etc/hostname", "raspberrypi\n")
        self.write("/etc/hosts", "127.0.0.1\tlocalhost\n127.0.1.1\traspberrypi\n")
        self.write("/usr/bin/raspi-config")
        self.write("/etc/avahi/services/.keep")
        self.write("/run/systemd/system/.keep")
        self.write("/etc/systemd/system/multi-user.target.wants/.keep")
        self.ran: list[str] = []

    def carry_out(self, steps: list[Step]) -> None:
        """Write the files, and make the changes of the programs called."""
        for change in (change for step in steps for change in step.changes):
            if not isinstance(change, Run):
                Machine(self).carry_out(change)
                continue
            self.ran.append(" ".join(change.command))
            match change.command:
                case ("systemctl", "enable", "--now", "naze-bridge"):
                    self.path("/etc/systemd/system/multi-user.target.wants/naze-bridge.service").symlink_to("x")
                case ("systemctl", "disable", "--now", unit):
                    self.path(f"/etc/systemd/system/getty.target.wants/{unit}").unlink()
                case ("hostnamectl", "set-hostname", name):
                    self.write("/etc/hostname", f"{name}\n")
                case ("systemd-run", *_):
                    (identity,) = re.findall(r"^uuid=.*", self.read(HOTSPOT), re.MULTILINE)
                    self.write("/run/NetworkManager/devices/3", f"[device]\nconnection-{identity}\n")
                    opened = self.read(HOTSPOT).replace("autoconnect=false", "autoconnect=true")
                    self.write(HOTSPOT, opened).chmod(0o600)
                case ("raspi-config", "nonint", "do_wifi_country", country):
                    self.write(CMDLINE, f"{self.read(CMDLINE).strip()} cfg80211.ieee80211_regdom={country}\n")


def test_a_fresh_card_is_set_up_in_one_run(tmp_path: Path, model: str) -> None:
    pi = FreshPi(tmp_path, model)
    answers = SetupChoices(hotspot=("naze field", "long-enough"), country="DE", name="naze", key="secret words")
    steps = missing_steps(pi, answers)
    pi.carry_out(steps)
    _, _, line = MODELS[model]
    assert pi.read(CONFIG).splitlines()[-1] == line
    assert "dtparam=audio=on\n[cm4]" in pi.read(CONFIG)
    # serial0 is the Pi 5's debug socket, so its console does no harm.
    has_console = "console=serial0,115200" in pi.read(CMDLINE)
    assert has_console is (model == "5")
    assert "console=tty1 root=PARTUUID=1-02 rootwait" in pi.read(CMDLINE)
    settings = tomllib.loads(pi.read(SETTINGS_FILE))
    assert "fc" not in settings  # not given: config.toml, or the search
    assert settings["web"]["listen"] == "0.0.0.0:8080"
    assert settings["key_file"] == "/etc/naze-bridge/gcs.key"
    assert pi.path("/etc/naze-bridge/gcs.key").stat().st_mode & 0o777 == 0o600
    assert pi.path(HOTSPOT).stat().st_mode & 0o777 == 0o600
    assert hotspot_name(pi) == "naze field"
    assert "127.0.1.1\tnaze\n" in pi.read("/etc/hosts")
    announcement = pi.path("/etc/avahi/services/naze-bridge.service")
    assert "_mavlink._udp" in announcement.read_text()
    assert announcement.stat().st_mode & 0o777 == 0o644
    assert "systemctl try-restart avahi-daemon" in pi.ran
    assert [step.purpose for step in steps if step.needs_reboot]
    # This step may end the SSH connection.
    assert steps[-1].cuts_network
    assert "service.cli.setup.hotspot" in pi.ran[-1]
    assert missing_steps(pi, answers) == []


@pytest.mark.parametrize(("serial0", "config"), [("ttyAMA10", "[all]\nenable_uart=1\n"), ("ttyAMA0", "[all]\n")])
def test_a_pi_5_whose_serial0_is_the_header_loses_the_console(tmp_path: Path, serial0: str, config: str) -> None:
    """Its bootloaders since 2025-02-12 do that for enable_uart=1, which Ubuntu sets, and a card used in a Pi 4."""
    pi = FreshPi(tmp_path, "5")
    pi.path("/dev/serial0").unlink()
    pi.path("/dev/serial0").symlink_to(serial0)
    pi.write(CONFIG, config)
    pi.carry_out(missing_steps(pi, SetupChoices()))
    assert "console=serial0" not in pi.read(CMDLINE)


def test_cloud_init_keeps_the_chosen_name(tmp_path: Path) -> None:
    """At each start it sets the name in its file on the boot partition, by which it writes /etc/hosts, too."""
    pi = FreshPi(tmp_path, "4")
    pi.write("/boot/firmware/user-data", "#cloud-config\nhostname: raspberrypi\nmanage_etc_hosts: true\nusers: []\n")
    pi.carry_out(missing_steps(pi, SetupChoices(name="kite")))
    named = "#cloud-config\nhostname: 'kite'\nmanage_etc_hosts: true\nusers: []\n"
    assert pi.read("/boot/firmware/user-data") == named
    assert missing_steps(pi, SetupChoices(name="kite")) == []


def test_a_failed_hotspot_is_retried(tmp_path: Path) -> None:
    pi = FreshPi(tmp_path, "4")
    answers = SetupChoices(hotspot=("naze field", "long-enough"))
    pi.carry_out(missing_steps(pi, answers))
    pi.path("/run/NetworkManager/devices/3").unlink()
    (step,) = missing_steps(pi, answers)
    assert step.purpose == "open the Wi-Fi hotspot 'naze field'"


@pytest.mark.parametrize("fc", ["/dev/ttyUSB0,57600", '/dev/the "naze"', "/dev/a\\b", "/dev/näze"])
def test_any_port_gives_a_valid_settings_file(fc: str, tmp_path: Path) -> None:
    text = settings_text(FreshPi(tmp_path, "4"), SetupChoices(fc=fc))
    assert tomllib.loads(text)["fc"] == fc


@pytest.mark.parametrize(
    ("given", "is_on"),
    [
        ("enable_uart=1\n", True),
        ("#enable_uart=1\n", False),
        ("enable_uart=1\n[all]\nenable_uart=0\n", False),
        ("enable_uart=10\n", False),
        ("[pi4]\nenable_uart=1\n", False),
        ("[pi4]\nenable_uart=0\n[all]\nenable_uart=1\n[cm5]\nenable_uart=0\n", True),
    ],
)
def test_the_last_entry_for_all_models_in_config_txt_counts(tmp_path: Path, given: str, is_on: bool) -> None:
    pi = FreshPi(tmp_path, "4")
    pi.write(CONFIG, given)
    purposes = [step.purpose for step in missing_steps(pi, SetupChoices())]
    assert ("enable the UART on the header" not in purposes) is is_on


def test_setup_of_an_image_for_every_model_does_not_start_services(tmp_path: Path) -> None:
    pi = FreshPi(tmp_path, "4")
    pi.path("/proc/device-tree/model").unlink()
    pi.path("/run/systemd/system/.keep").unlink()
    pi.path("/run/systemd/system").rmdir()
    steps = missing_steps(pi, SetupChoices(name="naze", hotspot=("naze", "long-enough")))
    commands = [change.command for step in steps for change in step.changes if isinstance(change, Run)]
    assert commands == [
        ("systemctl", "enable", "naze-bridge"),
        ("systemctl", "enable", "naze-bridge-captive.socket"),
    ]
    (uart,) = [change for step in steps for change in step.changes if change.describe().endswith("config.txt")]
    assert isinstance(uart, WriteFile)
    assert uart.text.endswith("[all]\n# naze-bridge: the UART on GPIO 14 and 15\nenable_uart=1\ndtparam=uart0=on\n")
