# SPDX-License-Identifier: GPL-3.0-or-later
"""Undervoltage: now by the kernel or the firmware, and earlier since the start."""

from service.cli.doctor.machine import check_power
from tests.support.doctor import assert_note, assert_ok, assert_problem
from tests.support.faulty_machine import FaultyMachine

_SENSOR = "/sys/class/hwmon/hwmon1"


def test_the_kernels_alarm_is_a_problem_until_the_supply_is_changed(pi: FaultyMachine) -> None:
    pi.write("/sys/class/hwmon/hwmon0/name", "cpu_thermal\n")
    pi.write(f"{_SENSOR}/name", "rpi_volt\n")
    pi.write(f"{_SENSOR}/in0_lcrit_alarm", "1\n")
    assert_problem(check_power(pi, lambda: ""), "too low", "5.1 V")
    pi.write(f"{_SENSOR}/in0_lcrit_alarm", "0\n")
    assert_ok(check_power(pi, lambda: ""), "no undervoltage")


def test_the_firmware_also_knows_the_past(pi: FaultyMachine) -> None:
    assert_problem(check_power(pi, lambda: "throttled=0x50005\n"), "is too low", "5.1 V")
    assert_note(check_power(pi, lambda: "throttled=0x50000\n"), "was too low since the start")
    assert_ok(check_power(pi, lambda: "throttled=0x0\n"), "no undervoltage since the start")


def test_another_machine_has_no_such_check(pi: FaultyMachine) -> None:
    assert check_power(pi, lambda: "") is None
    assert check_power(pi, lambda: "VCHI initialization failed") is None
