# SPDX-License-Identifier: GPL-3.0-or-later
"""One measured figure, with the machine's own floor and the promised limit."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Floor:
    """The lowest value possible on this machine, in the figure's unit, and its description."""

    value: float
    of: str


@dataclass(frozen=True, slots=True)
class Figure:
    """A measured value; smaller is better.

    `limit` is the greatest allowed value, in `unit`, or a multiple of the floor if `times_floor`; None for a figure
    that only explains another one.
    """

    name: str
    value: float
    unit: str
    floor: Floor | None = None
    limit: float | None = None
    times_floor: bool = False

    @property
    def ratio(self) -> float | None:
        """The value as a multiple of its floor."""
        return self.value / self.floor.value if self.floor and self.floor.value else None

    @property
    def is_missed(self) -> bool:
        judged = self.ratio if self.times_floor else self.value
        return self.limit is not None and judged is not None and judged > self.limit
