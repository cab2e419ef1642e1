# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine's files, below any root."""

import os
from pathlib import Path

from service.machine.host import Host
from tests.support.faulty_machine import FaultyMachine


def test_links_are_followed_within_the_root(tmp_path: Path) -> None:
    machine = FaultyMachine(tmp_path)
    assert machine.resolve("/dev/serial0") == Path("/dev/ttyAMA0")
    assert machine.resolve("/dev/ttyAMA0") == Path("/dev/ttyAMA0")


def test_a_serial_port_is_a_device_of_the_kernels_list() -> None:
    machine = Host()
    wire, terminal = os.openpty()
    assert machine.is_tty(os.ttyname(terminal))
    for other in ("/dev/null", "/dev/zero", "/etc/passwd", "/etc", "/dev/stdin", "/dev/missing", "/dev/\0", ""):
        assert not machine.is_tty(other), other
    os.close(wire)
    os.close(terminal)


def test_a_chain_and_a_ring_of_links(tmp_path: Path) -> None:
    machine = FaultyMachine(tmp_path)
    for name, target in (("naze", "serial0"), ("ring", "round"), ("round", "ring")):
        machine.path(f"/dev/{name}").symlink_to(target)
    assert machine.resolve("/dev/naze") == Path("/dev/ttyAMA0")
    assert not machine.is_tty(machine.resolve("/dev/ring"))


def test_missing_and_binary_files_are_read_as_text(tmp_path: Path) -> None:
    machine = Host(tmp_path)
    assert machine.read("/etc/os-release") == ""
    (tmp_path / "x").write_bytes(b"a\xffb")
    assert machine.read("/x").startswith("a")


def test_a_login_console_is_found_by_the_terminal(tmp_path: Path) -> None:
    machine = FaultyMachine(tmp_path)
    assert not machine.has_login("ttyAMA0")
    machine.runs(7, "/sbin/agetty", "-o", "--keep-baud", "ttyAMA0")
    assert machine.has_login("ttyAMA0")
    assert not machine.has_login("ttyS0")


def test_wifi_addresses_come_first(tmp_path: Path) -> None:
    machine = FaultyMachine(tmp_path)
    machine.addresses["eth0"] = "192.168.1.5"
    assert machine.ipv4_addresses() == ["192.168.4.1", "192.168.1.5"]
