# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of a check."""

from dataclasses import dataclass
from enum import Enum


class Grade(Enum):
    """`NOTE`: worth knowing, but the bridge works."""

    OK = "ok"
    NOTE = "note"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True)
class Checked:
    """One line: the subject, the finding, and a remedy if it is not OK."""

    check: str
    grade: Grade
    found: str
    remedy: str = ""


def ok(check: str, found: str) -> Checked:
    return Checked(check, Grade.OK, found)


def note(check: str, found: str, remedy: str) -> Checked:
    return Checked(check, Grade.NOTE, found, remedy)


def problem(check: str, found: str, remedy: str) -> Checked:
    return Checked(check, Grade.PROBLEM, found, remedy)
