# SPDX-License-Identifier: GPL-3.0-or-later
"""Problems of settings, reported all at once."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Problem:
    """`where`: file and line, environment variable or flag; may be empty. `text`: the problem, and the remedy."""

    where: str
    text: str

    def __str__(self) -> str:
        return f"{self.where}: {self.text}" if self.where else self.text


class SettingsError(ValueError):
    """Settings that cannot be used; one line per problem."""

    def __init__(self, problems: Sequence[Problem] | str) -> None:
        self.problems = (Problem("", problems),) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))
