# SPDX-License-Identifier: GPL-3.0-or-later
"""What a check found."""

from dataclasses import dataclass
from enum import Enum


class Grade(Enum):
    """`NOTE` is worth knowing, but nothing that keeps the bridge from flying."""

    OK = "ok"
    NOTE = "note"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True)
class Checked:
    """One line: what was looked at, what was found, and what to do about it if it is not ok."""

    check: str
    grade: Grade
    found: str
    remedy: str = ""


def ok(check: str, found: str) -> Checked:
    """It is as it should be."""
    return Checked(check, Grade.OK, found)


def note(check: str, found: str, remedy: str) -> Checked:
    """It may be in the way some day."""
    return Checked(check, Grade.NOTE, found, remedy)


def problem(check: str, found: str, remedy: str) -> Checked:
    """It is in the way."""
    return Checked(check, Grade.PROBLEM, found, remedy)
