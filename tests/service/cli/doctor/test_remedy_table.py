# SPDX-License-Identifier: GPL-3.0-or-later
"""One table of faults: each finding's command is carried out on the faulty machine, and the fault is gone."""

import re
import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from service.cli.doctor.checked import Checked, Grade
from service.cli.doctor.examination import examine
from service.cli.doctor.machine import check_clock, check_root
from service.cli.doctor.network import check_ports
from service.cli.doctor.port import check_holder
from service.machine.raspberry_pi import clock_trouble
from service.settings import Settings
from service.settings.addresses import SerialFc
from tests.service.cli.doctor.test_network import UDP_14550
from tests.support.doctor import GCS, STATUS, no_answer
from tests.support.faulty_machine import PORT, FaultyMachine

_DROPS_ALL = "table inet filter {\n\tchain input {\n\t\ttype filter hook input priority filter; policy drop;\n\t}\n}\n"
_RULES, _CLOCK = "/rules", "/clock"
_ACCEPT = "sudo nft insert rule inet filter input udp dport 14550 accept"
Check = Callable[[FaultyMachine], list[Checked]]


def runs(pi: FaultyMachine, unit: str, *arguments: str, has_open: str = "/dev/ttyAMA0") -> None:
    pi.runs(99, *arguments, has_open=has_open)
    pi.write("/proc/99/cgroup", f"0::{unit}\n")


def in_a_service(pi: FaultyMachine) -> None:
    runs(pi, "/system.slice/mavlink-router.service", "/usr/bin/mavlink-routerd")


def by_a_socket(pi: FaultyMachine) -> None:
    runs(pi, "/system.slice/gpsd.service", "/usr/sbin/gpsd")
    pi.write("/usr/lib/systemd/system/gpsd.socket")


def by_hand(pi: FaultyMachine) -> None:
    runs(pi, "/user.slice/user-1000.slice/session-3.scope", "/usr/bin/python3", "/home/pi/my_logger.py")


def on_our_port(pi: FaultyMachine) -> None:
    pi.sockets(udp=UDP_14550)
    runs(
        pi,
        "/system.slice/system-mavproxy.slice/mavproxy@1.service",
        "/usr/bin/python3",
        "-m",
        "mavproxy",
        has_open="socket:[4711]",
    )


def behind_a_firewall(pi: FaultyMachine) -> None:
    pi.write(_RULES, _DROPS_ALL)


def on_an_overlay(pi: FaultyMachine) -> None:
    pi.write("/proc/self/mountinfo", "27 1 0:24 / / rw - overlay overlayroot rw,upperdir=/media/root-rw/overlay\n")


def on_a_worn_out_card(pi: FaultyMachine) -> None:
    pi.write("/proc/self/mountinfo", "27 1 179:2 / / ro,noatime - ext4 /dev/mmcblk0p2 ro\n")


def holder(pi: FaultyMachine) -> list[Checked]:
    found = check_holder(pi, PORT)
    return [] if found is None else [found]


def ports(pi: FaultyMachine) -> list[Checked]:
    return list(check_ports(pi, Settings(PORT, GCS), is_running=False, ask=lambda *_: pi.read(_RULES)))


def root(pi: FaultyMachine) -> list[Checked]:
    found = check_root(pi)
    return [] if found is None else [found]


def on_the_mini_uart(pi: FaultyMachine) -> None:
    pi.is_a("Raspberry Pi Zero W Rev 1.1", header="ttyS0")


def with_a_late_clock(pi: FaultyMachine) -> None:
    pi.write(_CLOCK, "259200")


def board(pi: FaultyMachine) -> list[Checked]:
    is_silent = pi.resolve("/dev/serial0") != Path("/dev/ttyAMA0")
    status = STATUS | ({"flight_controller": None, "state": "searching"} if is_silent else {})
    found = examine(pi, Settings(PORT, GCS, pi.root), lambda: status, no_answer)
    return [each for each in found if each.check == "flight controller"]


def clock(pi: FaultyMachine) -> list[Checked]:
    off_s = float(pi.read(_CLOCK) or 0)
    return [check_clock(pi, datetime(2026, 11, 28, tzinfo=UTC), clock_trouble(off_s, "the flight controller"))]


def carry_out(pi: FaultyMachine, command: str) -> None:
    """The effect of a printed command. systemd starts a service again whose process was killed."""
    cgroup = pi.read("/proc/99/cgroup")
    if stopped := re.match(r"sudo systemctl disable --now (.*)", command):
        units = {unit if "." in unit else f"{unit}.service" for unit in stopped[1].split()}
        is_started_again = pi.path("/usr/lib/systemd/system/gpsd.socket").exists() and "gpsd.socket" not in units
        if cgroup.rstrip("\n").rpartition("/")[2] in units and not is_started_again:
            shutil.rmtree(pi.path("/proc/99"))
            pi.sockets()
    elif command == "sudo kill 99" and ".service" not in cgroup:
        shutil.rmtree(pi.path("/proc/99"))
    elif rule := re.match(r"sudo nft insert rule inet filter input (.*)", command):
        pi.write(_RULES, _DROPS_ALL.replace("policy drop;", f"policy drop;\n\t\t{rule[1]}"))
    elif added := re.match(r"printf '(.*)' \| sudo tee -a (\S+) && sudo reboot", command):
        file = pi.path(added[2])
        file.write_text(file.read_text() + added[1].replace("\\n", "\n"))
        if file.read_text().endswith("\n[all]\ndtoverlay=disable-bt\n"):
            pi.path("/dev/serial0").unlink()
            pi.path("/dev/serial0").symlink_to("ttyAMA0")
    elif moved := re.match(r"sudo date --set '([+-]\d+) seconds'", command):
        pi.write(_CLOCK, str(float(pi.read(_CLOCK)) - float(moved[1])))
    elif command in ("sudo raspi-config nonint disable_overlayfs && sudo reboot", "sudo mount -o remount,rw /"):
        pi.write("/proc/self/mountinfo", "27 1 179:2 / / ro,noatime - ext4 /dev/mmcblk0p2 rw\n")


@pytest.mark.parametrize(
    ("fault", "check", "found", "command"),
    [
        (in_a_service, holder, "mavlink-routerd (pid 99) has", "sudo systemctl disable --now mavlink-router"),
        (by_a_socket, holder, "gpsd (pid 99) has", "sudo systemctl disable --now gpsd.socket gpsd"),
        (by_hand, holder, "my_logger.py (pid 99) has", "sudo kill 99"),
        (on_our_port, ports, "is used by mavproxy (pid 99)", "sudo systemctl disable --now mavproxy@1"),
        (
            behind_a_firewall,
            ports,
            "drops packets to UDP",
            "sudo nft insert rule inet filter input udp dport 14550 accept",
        ),
        (on_an_overlay, root, "an overlay in memory", "sudo raspi-config nonint disable_overlayfs && sudo reboot"),
        (on_a_worn_out_card, root, "read-only", "sudo mount -o remount,rw /"),
        (
            on_the_mini_uart,
            board,
            "the port is the mini-UART",
            "printf '\\n[all]\\ndtoverlay=disable-bt\\n' | sudo tee -a /boot/firmware/config.txt && sudo reboot",
        ),
        (with_a_late_clock, clock, "3 days, 0:00:00 behind the flight", "sudo date --set '+259200 seconds'"),
    ],
)
def test_the_command_of_a_finding_removes_the_fault(
    pi: FaultyMachine,
    fault: Callable[[FaultyMachine], None],
    check: Callable[[FaultyMachine], list[Checked]],
    found: str,
    command: str,
) -> None:
    assert [each for each in check(pi) if each.grade is not Grade.OK] == []
    fault(pi)
    (finding,) = (each for each in check(pi) if each.grade is not Grade.OK)
    assert found in finding.found
    assert command in finding.remedy
    carry_out(pi, command)
    assert [each for each in check(pi) if each.grade is not Grade.OK] == []


def test_bluetooths_uart_is_not_the_headers(pi: FaultyMachine) -> None:
    pi.write("/dev/ttyS0")
    pi.path("/dev/serial0").unlink()
    pi.path("/dev/serial0").symlink_to("ttyS0")
    runs(pi, "/system.slice/hciuart.service", "/usr/bin/hciattach", "/dev/ttyAMA0")
    found = check_holder(pi, SerialFc("/dev/ttyAMA0", None))
    assert found is not None
    assert "this UART is Bluetooth's" in found.remedy
    assert "sudo naze-bridge setup --fc /dev/serial0" in found.remedy
