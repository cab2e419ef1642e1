# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's port: missing, forbidden, or used by something else."""

from pathlib import Path

import pytest

from service.cli.doctor.checked import Checked
from service.cli.doctor.examination import examine
from service.cli.doctor.port import check_console, check_holder, check_permission, check_port
from service.settings import Settings
from service.settings.addresses import AutoFc, SerialFc
from tests.support.doctor import GCS, STATUS, assert_ok, assert_problem, no_answer
from tests.support.faulty_machine import PORT, FaultyMachine


def test_a_missing_port_is_a_problem(pi: FaultyMachine) -> None:
    pi.path("/dev/serial0").unlink()
    pi.write("/proc/device-tree/model", "Raspberry Pi 4 Model B Rev 1.4\0")
    assert_problem(check_port(pi, PORT), "/dev/serial0 is missing", "sudo naze-bridge setup")
    pi.write("/dev/ttyUSB0")
    assert_problem(check_port(pi, PORT), "/dev/serial0 is missing", "sudo naze-bridge setup --fc /dev/ttyUSB0")
    assert_problem(check_port(pi, PORT, "--fc"), "/dev/serial0 is missing", "omit --fc, or give it /dev/ttyUSB0")
    assert_problem(check_port(pi, SerialFc("/dev/naze", None)), "/dev/naze is missing", "plug the flight controller in")
    # There are no further checks of a missing port.
    assert check_permission(pi, PORT) is check_console(pi, PORT) is check_holder(pi, PORT) is None


def test_without_a_named_port_every_port_is_checked(pi: FaultyMachine, tmp_path: Path) -> None:
    def checked() -> dict[str, Checked]:
        return {each.check: each for each in examine(pi, Settings(AutoFc(), GCS, tmp_path), no_answer, lambda: STATUS)}

    assert_ok(checked()["flight controller"], "Harakiri")
    pi.runs(412, "/sbin/agetty", "ttyAMA0")
    assert_problem(checked()["console"], "serial-getty@ttyAMA0 runs there", "disable --now")
    pi.path("/dev/serial0").unlink()
    assert_problem(checked()["port"], "there is no serial port", "plug the flight controller")
    pi.write("/proc/device-tree/model", "Raspberry Pi 4 Model B Rev 1.4\0")
    assert_problem(checked()["port"], "/dev/serial0 is missing", "sudo naze-bridge setup")


def test_without_a_named_port_the_daemons_own_is_checked(pi: FaultyMachine, tmp_path: Path) -> None:
    """It runs on the port or simulator of its --fc."""
    pi.path("/dev/serial0").unlink()
    running = STATUS | {"where": "sim:"}
    found = {each.check: each for each in examine(pi, Settings(AutoFc(), GCS, tmp_path), lambda: running, no_answer)}
    assert_ok(found["port"], "sim:, not a serial port")
    assert_ok(found["flight controller"], "Harakiri")
    searching = running | {"where": "the serial ports", "port": None, "ports_passed_over": []}
    found = {each.check: each for each in examine(pi, Settings(AutoFc(), GCS, tmp_path), lambda: searching, no_answer)}
    assert_problem(found["port"], "there is no serial port", "plug the flight controller")


def test_a_running_login_console_is_reported_once(pi: FaultyMachine) -> None:
    pi.runs(412, "/sbin/agetty", "--keep-baud", "115200,57600", "ttyAMA0", "vt220", has_open="/dev/ttyAMA0")
    assert_problem(
        check_console(pi, PORT),
        "serial-getty@ttyAMA0 runs there",
        "sudo systemctl disable --now serial-getty@ttyAMA0.service",
    )
    # It is one fault and reported once.
    assert check_holder(pi, PORT) is None


def test_a_login_console_enabled_for_the_next_boot_is_found(pi: FaultyMachine) -> None:
    pi.write("/etc/systemd/system/getty.target.wants/serial-getty@ttyAMA0.service")
    assert_problem(check_console(pi, PORT), "is enabled", "disable --now serial-getty@ttyAMA0.service")


@pytest.mark.parametrize("word", ["console=serial0,115200", "console=ttyAMA0", "console=ttyAMA0,115200n8"])
def test_a_kernel_console_is_a_problem(pi: FaultyMachine, word: str) -> None:
    pi.write("/boot/firmware/cmdline.txt", f"{word} console=tty1 rootwait\n")
    name = word.removeprefix("console=").partition(",")[0]
    assert_problem(
        check_console(pi, PORT),
        f"{word} is in /boot/firmware/cmdline.txt",
        f"sudo sed -i 's/console={name}[^ ]* *//' /boot/firmware/cmdline.txt && sudo reboot",
    )


def test_a_console_on_another_port_is_fine(pi: FaultyMachine) -> None:
    pi.runs(412, "/sbin/agetty", "ttyAMA10")
    pi.write("/proc/cmdline", "console=ttyAMA10,115200 console=tty1")
    assert_ok(check_console(pi, PORT), "no login console on /dev/ttyAMA0")


def test_a_daemon_on_the_port_is_fine_and_not_touched(pi: FaultyMachine, tmp_path: Path) -> None:
    pi.runs(99, "/usr/lib/naze-bridge/bin/python3", "-I", "/usr/bin/naze-bridge", "run", has_open="/dev/ttyAMA0")
    assert_ok(check_holder(pi, PORT), "the daemon has /dev/ttyAMA0 open")

    def never() -> dict[str, object]:
        raise AssertionError("the port was opened although the daemon uses it")

    found = list(examine(pi, Settings(PORT, GCS, tmp_path), no_answer, never))
    assert [each.found for each in found if each.check == "flight controller"] == ["/dev/serial0 was not checked"]
