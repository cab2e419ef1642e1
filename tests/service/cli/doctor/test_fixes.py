# SPDX-License-Identifier: GPL-3.0-or-later
"""Each remedy that the status page can carry out: applied by the helper, it turns the check ok."""

import sqlite3
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from service.cli.helper.action import HelperRefusal
from service.cli.setup.answers import SETTINGS_FILE
from service.daemon.store_worker import DATABASE_NAME
from service.settings.load import SERVICE_STATE
from tests.support.doctor import STATUS
from tests.support.fixable_pi import FixablePi

#: 14550 in /proc/net/udp, held by the socket 4711.
_UDP_14550 = "   1: 00000000:38D6 00000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 4711 2 0 0\n"


@pytest.fixture
def pi(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FixablePi:
    return FixablePi(tmp_path / "root", monkeypatch)


def console(pi: FixablePi) -> None:
    pi.write("/boot/firmware/cmdline.txt", "console=serial0,115200 console=tty1 rootwait\n")
    pi.runs(60, "agetty", "ttyAMA0")


def started_with_a_console(pi: FixablePi) -> None:
    pi.write("/proc/cmdline", "console=ttyAMA0,115200 console=tty1 rootwait\n")


def another_program(pi: FixablePi) -> None:
    pi.status = None
    pi.runs(61, "minicom", has_open="/dev/ttyAMA0")


def no_permission(pi: FixablePi) -> None:
    pi.path("/dev/ttyAMA0").chmod(0o600)


def port_off(pi: FixablePi) -> None:
    pi.write(SETTINGS_FILE, 'fc = "/dev/serial0"\n')
    pi.path("/dev/ttyAMA0").unlink()
    pi.write("/boot/firmware/config.txt")


def wrong_port(pi: FixablePi) -> None:
    pi.write(SETTINGS_FILE, 'fc = "/dev/ttyUSB7"\n')
    pi.write("/dev/ttyUSB0").chmod(0o660)
    pi.owned_by("/dev/ttyUSB0", "dialout")


def radio_off(pi: FixablePi) -> None:
    pi.write("/boot/firmware/cmdline.txt", "console=tty1 cfg80211.ieee80211_regdom=DE\n")
    pi.write("/sys/class/rfkill/rfkill0/type", "wlan\n")
    pi.write("/sys/class/rfkill/rfkill0/soft", "1\n")


def port_taken(pi: FixablePi) -> None:
    pi.sockets(udp=_UDP_14550)
    pi.runs(63, "mavproxy.py", has_open="socket:[4711]")


def store_trouble(pi: FixablePi) -> None:
    pi.status = {**STATUS, "port": {}, "where": "/dev/serial0", "store_trouble": "disk full"}


def damaged_store(pi: FixablePi) -> None:
    sqlite3.connect(pi.path(f"{SERVICE_STATE}/{DATABASE_NAME}")).execute("CREATE TABLE other (x)").connection.close()


FAULTS: list[tuple[Callable[[FixablePi], None], str, str]] = [
    (console, "console", "free the UART from the login console"),
    (no_permission, "permission", "give the serial ports to the group dialout"),
    (wrong_port, "port", "look for the flight controller on all ports"),
    (radio_off, "Wi-Fi", "switch the Wi-Fi on"),
    (store_trouble, "store", "restart the bridge"),
    (damaged_store, "missions", "restart the bridge"),
]


def faults(pi: FixablePi, check: str) -> list[str | None]:
    return [found["fix"] for found in pi.checked(check) if found["grade"] != "ok"]


@pytest.mark.parametrize(("fault", "check", "fix"), FAULTS)
def test_a_fix_makes_the_check_ok(pi: FixablePi, fault: Callable[[FixablePi], None], check: str, fix: str) -> None:
    assert faults(pi, check) == []
    fault(pi)
    assert faults(pi, check) == [fix]
    reply = pi.ask("fix", fix=fix)
    assert [step["purpose"] for step in reply["steps"]] == [fix]
    assert faults(pi, check) == []


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        (another_program, "other programs"),
        (port_taken, "listening port"),
        (started_with_a_console, "console"),
    ],
)
def test_programs_are_not_ended_and_the_pi_not_restarted_from_the_page(
    pi: FixablePi, fault: Callable[[FixablePi], None], check: str
) -> None:
    fault(pi)
    assert faults(pi, check) == [None]


@pytest.mark.parametrize("where", ["/etc/shadow", "/dev/../etc/shadow", 5, None, "\n", "\ud800", "x" * 100_000, [], {}])
def test_a_lying_daemon_cannot_get_a_remedy_for_a_file(pi: FixablePi, where: object) -> None:
    pi.write("/etc/shadow", "root::").chmod(0o600)
    pi.status = {**STATUS, "where": where, "speed_baud": [], "armed": {}, "refused": [7], "found_s": 10**400}
    offered = {found["fix"] for found in pi.ask("doctor")["checks"]}
    assert offered <= {None, "look for the flight controller on all ports", "restart the bridge"}
    for fix in ("open /etc/shadow to the group dialout", "stop the program with pid 1", "/etc/shadow"):
        with pytest.raises(HelperRefusal):
            pi.ask("fix", fix=fix)
    assert pi.ran == []
    assert pi.path("/etc/shadow").stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("fc", ["/etc/shadow", "/dev/../etc/shadow"])
def test_a_port_in_the_settings_that_is_a_file(pi: FixablePi, fc: str) -> None:
    pi.write(SETTINGS_FILE, f'fc = "{fc}"\n')
    pi.write("/etc/shadow", "root::").chmod(0o600)
    assert faults(pi, "port") == ["look for the flight controller on all ports"]
    assert faults(pi, "permission") == []


def test_a_missing_uart_is_enabled_and_there_after_the_restart(pi: FixablePi) -> None:
    port_off(pi)
    reply = pi.ask("fix", fix="enable the UART on the header")
    assert reply["needs_reboot"]
    assert pi.read("/boot/firmware/config.txt").endswith("enable_uart=1\n")
    pi.reboot()
    assert faults(pi, "port") == []


def test_a_wrong_fixed_speed(pi: FixablePi) -> None:
    pi.write(SETTINGS_FILE, 'fc = "/dev/serial0,9600"\n')
    silent = {"flight_controller": None, "state": "searching", "fc_bytes_received": 5000}
    pi.status = {**STATUS, "port": {}, "where": "/dev/serial0", **silent}
    assert faults(pi, "flight controller") == ["look for the flight controller on all ports"]
    pi.ask("fix", fix="look for the flight controller on all ports")
    assert "fc" not in tomllib.loads(pi.read(SETTINGS_FILE))


def test_a_value_written_by_hand_is_not_fixed_from_the_page(pi: FixablePi) -> None:
    wrong_port(pi)
    pi.write("/etc/naze-bridge/config.toml", 'fc = "/dev/ttyUSB7"\n')
    assert faults(pi, "port") == [None]


def test_without_a_country_the_radio_cannot_be_switched_on(pi: FixablePi) -> None:
    radio_off(pi)
    pi.write("/boot/firmware/cmdline.txt", "console=tty1\n")
    assert faults(pi, "Wi-Fi") == [None]
