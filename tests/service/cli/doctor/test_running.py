# SPDX-License-Identifier: GPL-3.0-or-later
"""Troubles that a running daemon's status shows; each check turns ok, or silent, once its remedy was applied."""

from pathlib import Path

import pytest

from bridge.controllers.harakiri.profile import PATCHED, UNPATCHED
from service.cli.doctor.running import check_daemons, check_running
from tests.support.doctor import STATUS, assert_note, assert_problem
from tests.support.faulty_machine import FaultyMachine


def test_a_harakiri_without_the_patch_until_it_is_flashed() -> None:
    assert_note(check_running(STATUS | {"flight_controller": UNPATCHED.name}), "no mission extension")
    assert list(check_running(STATUS | {"flight_controller": PATCHED.name})) == []


@pytest.mark.parametrize(
    ("damaged", "found_s", "is_bad"), [(5000, 3600.0, True), (9, 5.0, False), (12, 36000.0, False), (0, None, False)]
)
def test_a_line_that_damages_replies(damaged: int, found_s: float | None, *, is_bad: bool) -> None:
    found = list(check_running(STATUS | {"bad_checksums": damaged, "found_s": found_s}))
    if is_bad:
        assert_problem(found, "5000 damaged replies in 60 min", "GND at both ends")
    else:
        assert found == []


def test_stations_without_the_key() -> None:
    refused = [
        "7 x not signed (udpin:0.0.0.0:14550)",
        "1 x open link; see pass_through in settings (udpin:0.0.0.0:14550)",
    ]
    (found,) = check_running(STATUS | {"refused": refused})
    assert_note(found, "7 requests on udpin:0.0.0.0:14550 were refused: not signed")
    assert "setup --new-key" in found.remedy


def test_a_store_that_cannot_write() -> None:
    assert_problem(check_running(STATUS | {"store_trouble": "disk full"}), "disk full", "systemctl restart")


def test_two_daemons_on_a_port_until_one_is_stopped(tmp_path: Path) -> None:
    pi = FaultyMachine(tmp_path / "root")
    for pid in (70, 71):
        pi.runs(pid, "python3", "/usr/bin/naze-bridge", "run", has_open="/dev/ttyAMA0")
    pi.write("/proc/71/cgroup", "0::/system.slice/naze-bridge.service\n")
    found = check_daemons(pi)
    assert_problem(found, "2 daemons have /dev/ttyAMA0 open (pids 71, 70)", "sudo kill 70")
    pi.path("/proc/70/cmdline").unlink()
    assert check_daemons(pi) is None


@pytest.mark.parametrize("other", ["/dev/ttyUSB0", "/dev/tty1", ""])
def test_daemons_on_different_ports(tmp_path: Path, other: str) -> None:
    pi = FaultyMachine(tmp_path / "root")
    pi.runs(70, "python3", "/usr/bin/naze-bridge", "run", has_open="/dev/ttyAMA0")
    pi.runs(71, "python3", "/usr/bin/naze-bridge", "run", has_open=other)
    assert check_daemons(pi) is None
