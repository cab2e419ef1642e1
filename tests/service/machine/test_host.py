# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine's files, below any root."""

from pathlib import Path

from service.machine.host import Host
from tests.support.faulty_machine import FaultyMachine


def test_links_are_followed_within_the_root(tmp_path: Path) -> None:
    machine = FaultyMachine(tmp_path)
    assert machine.resolve("/dev/serial0") == Path("/dev/ttyAMA0")
    assert machine.resolve("/dev/ttyAMA0") == Path("/dev/ttyAMA0")


def test_a_missing_file_and_a_binary_one_are_texts(tmp_path: Path) -> None:
    machine = Host(tmp_path)
    assert machine.read("/etc/os-release") == ""
    (tmp_path / "x").write_bytes(b"a\xffb")
    assert machine.read("/x").startswith("a")


def test_a_login_console_is_found_by_its_terminal(tmp_path: Path) -> None:
    machine = FaultyMachine(tmp_path)
    assert not machine.has_login("ttyAMA0")
    machine.runs(7, "/sbin/agetty", "-o", "--keep-baud", "ttyAMA0")
    assert machine.has_login("ttyAMA0")
    assert not machine.has_login("ttyS0")


def test_wifi_addresses_come_first(tmp_path: Path) -> None:
    machine = FaultyMachine(tmp_path)
    machine.addresses["eth0"] = "192.168.1.5"
    assert machine.ipv4_addresses() == ["192.168.4.1", "192.168.1.5"]
