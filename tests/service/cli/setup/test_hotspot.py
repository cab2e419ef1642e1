# SPDX-License-Identifier: GPL-3.0-or-later
"""The change from a Wi-Fi network to the hotspot, with a NetworkManager made of files."""

import re
import subprocess
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from service.cli.setup.change import Machine, SetupError
from service.cli.setup.hotspot import (
    CAPTIVE_FILE,
    CONNECTION,
    HOTSPOT_FILE,
    JOIN_S,
    captive_steps,
    close_hotspot,
    hotspot_name,
    hotspot_steps,
    open_hotspot,
)
from service.machine.host import Host
from tests.support.faulty_machine import FaultyMachine

_LEASES = "/var/lib/NetworkManager/dnsmasq-wlan0.leases"
#: Names that NetworkManager would read as a list of bytes, without blanks or as escapes; and all signs of a password.
_NETWORKS = [
    (" naze\\field", "long-enough"),
    ("70;71;72;", "  eight "),
    ("kite  ", "\\s\\n\\x41;"),
    ("#Drachen=ü;\\", "".join(map(chr, range(0x20, 0x5F)))),
    ("1", "".join(map(chr, range(0x40, 0x7F)))),
]
_SECTIONS = ["[connection]", "[wifi]", "[wifi-security]", "[ipv4]", "[ipv6]"]
#: Prints what NetworkManager's library reads in a key file.
_READER = """
import sys, gi
gi.require_version("NM", "1.0")
from gi.repository import GLib, NM
text, file = sys.stdin.read(), GLib.KeyFile()
file.load_from_data(text, len(text.encode()), GLib.KeyFileFlags.NONE)
found = NM.keyfile_read(file, "/", NM.KeyfileHandlerFlags.NONE, lambda *_: sys.exit("not accepted"))
wifi, security = found.get_setting_wireless(), found.get_setting_wireless_security()
print(repr((wifi.get_ssid().get_data(), security.get_psk(), found.get_setting_ip4_config().get_method())), end="")
"""
_ARP = "IP address HW type Flags HW address Mask Device\n"


class NetworkManager(Machine):
    """Keeps the active connection of wlan0; `previous` is the home network's."""

    def __init__(self, host: Host, previous: str | None = "home-uuid", *, radio_works: bool = True) -> None:
        super().__init__(host)
        self.active = previous
        self._radio_works = radio_works

    def run(self, command: Sequence[str], timeout_s: float = 60) -> str:
        match tuple(command):
            case ("nmcli", "connection", "up", name):
                if name == CONNECTION and not self._radio_works:
                    raise SetupError("`nmcli connection up` failed: no radio")
                self.active = name
            case ("nmcli", "connection", "down", _):
                self.active = None
            case ("nmcli", "--terse", *_):
                return f"lo-uuid:lo\n{self.active}:wlan0\n" if self.active else "lo-uuid:lo\n"
        return ""


@pytest.fixture
def pi(tmp_path: Path) -> FaultyMachine:
    host = FaultyMachine(tmp_path)
    host.write("/run/systemd/system/.keep")
    host.write(_LEASES, "1 aa:bb 10.42.0.7 old-phone *\n")
    (step,) = hotspot_steps(host, _NETWORKS[0])
    Machine(host).carry_out(step.changes[0])
    return host


def opens_at_boot(pi: FaultyMachine) -> bool:
    return "autoconnect=true" in pi.read(HOTSPOT_FILE)


def after(seconds: int, happens: Callable[[], object]) -> Callable[[float], None]:
    """A sleep during which something happens."""
    left = [seconds]

    def sleep(_: float) -> None:
        left[0] -= 1
        if left[0] == 0:
            happens()

    return sleep


def test_it_stays_open_once_a_device_has_joined(pi: FaultyMachine) -> None:
    manager = NetworkManager(pi)
    assert not opens_at_boot(pi)
    joins = after(100, lambda: pi.write(_LEASES, "2 aa:bb 10.42.0.7 old-phone *\n"))
    assert open_hotspot(pi, manager, joins) == "the hotspot is open"
    assert manager.active == CONNECTION
    assert opens_at_boot(pi)
    assert pi.path(HOTSPOT_FILE).stat().st_mode & 0o777 == 0o600


def test_a_device_with_its_own_address_counts(pi: FaultyMachine) -> None:
    row = "10.42.0.9 0x1 {} aa:bb * wlan0\n"
    pi.write("/proc/net/arp", _ARP + row.format("0x0") + "192.168.1.1 0x1 0x2 cc:dd * wlan0\n")
    manager = NetworkManager(pi)
    joins = after(9, lambda: pi.write("/proc/net/arp", _ARP + row.format("0x2")))
    assert open_hotspot(pi, manager, joins) == "the hotspot is open"


def test_without_a_device_the_previous_network_returns(pi: FaultyMachine) -> None:
    manager = NetworkManager(pi)
    slept: list[float] = []
    told = open_hotspot(pi, manager, slept.append)
    assert told == f"no device joined the hotspot within {JOIN_S} s; back on the previous network"
    assert manager.active == "home-uuid"
    assert sum(slept) == JOIN_S
    assert not pi.path(HOTSPOT_FILE).exists()


def test_a_hotspot_that_cannot_open_leaves_the_previous_network(pi: FaultyMachine) -> None:
    manager = NetworkManager(pi, radio_works=False)
    assert open_hotspot(pi, manager, lambda _: None).endswith("no radio; back on the previous network")
    assert manager.active == "home-uuid"


def test_a_hotspot_that_cannot_open_is_kept_if_it_is_the_only_way_to_the_pi(pi: FaultyMachine) -> None:
    manager = NetworkManager(pi, previous=None, radio_works=False)
    assert "tried again, because there is no other network" in open_hotspot(pi, manager, lambda _: None)
    assert opens_at_boot(pi)
    assert hotspot_name(pi) == " naze\\field"


def test_a_kept_hotspot_opens_without_waiting_for_a_device(pi: FaultyMachine) -> None:
    (step,) = hotspot_steps(pi, _NETWORKS[0], is_kept=True)
    assert [change.describe() for change in step.changes[1:]] == [
        *("run nmcli connection reload", f"run nmcli connection up {CONNECTION}")
    ]
    Machine(pi).carry_out(step.changes[0])
    assert opens_at_boot(pi)
    assert list(hotspot_steps(pi, _NETWORKS[0], is_kept=True)) != []  # it is not open
    pi.write("/run/NetworkManager/devices/3", f"connection-uuid={uuid.uuid5(uuid.NAMESPACE_DNS, _NETWORKS[0][0])}\n")
    assert list(hotspot_steps(pi, _NETWORKS[0], is_kept=True)) == []


def test_without_a_previous_network_it_does_not_wait(pi: FaultyMachine) -> None:
    manager = NetworkManager(pi, previous=None)
    assert open_hotspot(pi, manager, lambda _: pytest.fail("it waited")) == "the hotspot is open"
    assert opens_at_boot(pi)


@pytest.mark.parametrize(("name", "password"), _NETWORKS)
def test_network_manager_reads_the_name_and_the_password_as_given(tmp_path: Path, name: str, password: str) -> None:
    host = Host(tmp_path)
    (step,) = hotspot_steps(host, (name, password))
    Machine(host).carry_out(step.changes[0])
    text = host.read(HOTSPOT_FILE)
    assert hotspot_name(host) == name
    assert f"\nssid={''.join(f'{byte};' for byte in name.encode())}\n" in text
    assert re.findall(r"^\[.*\]$", text, re.MULTILINE) == _SECTIONS
    read = subprocess.run(["/usr/bin/python3", "-c", _READER], input=text, capture_output=True, text=True, check=False)
    if read.returncode:
        pytest.skip("NetworkManager's own reader is not installed: apt-get install gir1.2-nm-1.0 python3-gi")
    assert read.stdout == repr((name.encode(), password, "shared"))


def test_it_is_closed_where_another_network_is_in_reach(pi: FaultyMachine) -> None:
    manager = NetworkManager(pi)
    open_hotspot(pi, manager, after(1, lambda: pi.write(_LEASES, "2 aa:bb 10.42.0.7 phone *\n")))
    pi.addresses = {"wlan0": "10.42.0.1"}
    joins = after(20, lambda: pi.addresses.update(wlan0="192.168.1.7"))
    assert close_hotspot(pi, manager, joins) == "the hotspot is closed"
    assert manager.active != CONNECTION
    assert not opens_at_boot(pi)


def test_it_stays_open_where_there_is_no_other_network(pi: FaultyMachine) -> None:
    manager = NetworkManager(pi)
    open_hotspot(pi, manager, after(1, lambda: pi.write(_LEASES, "2 aa:bb 10.42.0.7 phone *\n")))
    pi.addresses = {}
    told = close_hotspot(pi, manager, lambda _: None)
    assert told == "the Pi has no other network in reach; the hotspot is open again"
    assert manager.active == CONNECTION
    assert opens_at_boot(pi)


def test_phones_that_join_are_offered_the_page(pi: FaultyMachine) -> None:
    (step,) = captive_steps(pi, None, has_page=True)  # the hotspot of an earlier setup
    assert [change.describe() for change in step.changes] == [
        f"write {CAPTIVE_FILE}",
        "run systemctl enable --now --no-block naze-bridge-captive.socket",
    ]
    Machine(pi).carry_out(step.changes[0])
    assert list(captive_steps(pi, None, has_page=True)) == []
    (step,) = captive_steps(pi, None, has_page=False)
    assert step.changes[0].describe() == f"remove {CAPTIVE_FILE}"


def test_phones_are_offered_the_page_only_on_the_hotspot(tmp_path: Path) -> None:
    assert list(captive_steps(FaultyMachine(tmp_path / "other"), None, has_page=True)) == []


def test_the_clients_of_another_shared_connection_are_not_touched(pi: FaultyMachine) -> None:
    """Its name server reads the same settings as the hotspot's."""
    pi.write("/etc/NetworkManager/system-connections/cable.nmconnection", "[ipv4]\nmethod=shared\n")
    assert list(captive_steps(pi, None, has_page=True)) == []
