# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of a check."""

from dataclasses import dataclass
from enum import Enum

from payloads.mission_data import Json


class Grade(Enum):
    """`NOTE`: worth knowing, but the bridge works."""

    OK = "ok"
    NOTE = "note"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True)
class Checked:
    """One line: the subject, the finding, and a remedy if it is not OK. `fix`: its name in fixes.py, if any."""

    check: str
    grade: Grade
    found: str
    remedy: str = ""
    fix: str = ""

    def to_json(self) -> Json:
        return {"check": self.check, "grade": self.grade.value, "found": self.found, "remedy": self.remedy}


def ok(check: str, found: str) -> Checked:
    return Checked(check, Grade.OK, found)


def note(check: str, found: str, remedy: str, fix: str = "") -> Checked:
    return Checked(check, Grade.NOTE, found, remedy, fix)


def problem(check: str, found: str, remedy: str, fix: str = "") -> Checked:
    return Checked(check, Grade.PROBLEM, found, remedy, fix)
