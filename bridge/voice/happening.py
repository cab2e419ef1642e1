# SPDX-License-Identifier: GPL-3.0-or-later
"""A sentence of the table, and a happening: a sentence with the values, which the bridge reports once."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Generic, TypeVarTuple

#: Mission Planner shows each piece of a longer STATUSTEXT alone, and on the HUD only the last.
LINE_LENGTH = 50
#: A shortened name keeps this many characters.
_LEAST_OF_NAME = 10
Ts = TypeVarTuple("Ts")


class Severity(IntEnum):
    """MAV_SEVERITY."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6

    @property
    def is_on_hud(self) -> bool:
        """True if Mission Planner shows it on the HUD, and says it."""
        return self <= Severity.WARNING


class Sentence(Generic[*Ts]):
    """A row of the table, called with the values. `longest`: the longest values, which also declare the types.

    text: the whole sentence, for logs, commands and pages. short: the same for a HUD, where `text` may be too long.
    planner: the text that Mission Planner needs instead. lasts: bad news, which is repeated until the next Write.

    >>> Sentence(Severity.INFO, "Found {}", "Harakiri")("INAV").text
    'Found INAV'
    """

    def __init__(
        self,
        severity: Severity,
        text: str,
        *longest: *Ts,
        short: str = "",
        planner: str = "",
        lasts: bool = False,
    ) -> None:
        self.severity, self.text, self.short, self.planner = severity, text, short or text, planner
        self.longest: tuple[Any, ...] = longest
        self.lasts = lasts

    def __call__(self, *values: *Ts) -> "Happening":
        return Happening(self, values)


@dataclass(frozen=True, slots=True)
class Happening:
    """A sentence with the values. A HUD's line may shorten the first of them that is one word: a name."""

    sentence: Sentence[*tuple[Any, ...]]
    values: tuple[Any, ...] = ()

    @property
    def severity(self) -> Severity:
        return self.sentence.severity

    @property
    def text(self) -> str:
        """The whole sentence."""
        return self.sentence.text.format(*self.values)

    @property
    def line(self) -> str:
        """The sentence in at most 50 characters."""
        text = ""
        for text in self._shorter():
            if len(text) <= LINE_LENGTH:
                return text
        return text[: text.rfind(" ", 0, LINE_LENGTH - 2)].rstrip(",;:") + " .."

    def _shorter(self) -> Iterator[str]:
        yield self.text
        yield (short := self.sentence.short.format(*self.values))
        words = ((at, value) for at, value in enumerate(self.values) if isinstance(value, str) and " " not in value)
        at, name = next(words, (0, ""))
        room = len(name) - (len(short) - LINE_LENGTH)
        if _LEAST_OF_NAME <= room < len(name):
            values = *self.values[:at], shortened(name, room), *self.values[at + 1 :]
            short = self.sentence.short.format(*values)
        yield short

    def renamed(self, before: str, after: str) -> "Happening":
        """The same about a setting that the reader knows by another name."""
        return Happening(self.sentence, tuple(after if value == before else value for value in self.values))


def shortened(name: str, room: int) -> str:
    """A name in at most `room` characters, without the middle.

    >>> shortened("failsafe_off_delay_of_the_board", 16)
    'failsaf..e_board'
    """
    return name if len(name) <= room else f"{name[: (room - 1) // 2]}..{name[-((room - 2) // 2) :]}"
