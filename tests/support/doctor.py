# SPDX-License-Identifier: GPL-3.0-or-later
"""Assertions on doctor's findings."""

from collections.abc import Iterable

from service.cli.doctor.checked import Checked, Grade
from service.daemon.client import ControlError
from service.settings.addresses import parse_gcs


def one(found: Checked | Iterable[Checked] | None) -> Checked:
    assert found is not None
    if isinstance(found, Checked):
        return found
    (single,) = found
    return single


def assert_note(found: Checked | Iterable[Checked] | None, named: str) -> None:
    checked = one(found)
    assert checked.grade is Grade.NOTE
    assert named in checked.found
    assert checked.remedy


def assert_ok(found: Checked | Iterable[Checked] | None, named: str) -> None:
    checked = one(found)
    assert (checked.grade, checked.remedy) == (Grade.OK, "")
    assert named in checked.found


def no_answer() -> dict[str, object]:
    raise ControlError("no flight controller answers on /dev/serial0")


def assert_problem(found: Checked | Iterable[Checked] | None, named: str, remedy: str) -> None:
    checked = one(found)
    assert checked.grade is Grade.PROBLEM
    assert named in checked.found
    assert remedy in checked.remedy


GCS = [parse_gcs("udpin:0.0.0.0:14550")]


STATUS = {"flight_controller": "Harakiri", "state": "MSP", "speed_baud": 115200, "armed": False}
