# SPDX-License-Identifier: GPL-3.0-or-later
"""One measured figure, what the machine could do at best, and what was promised."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Floor:
    """The least that the figure could be here and now, in the figure's unit, and what that is the cost of."""

    value: float
    of: str


@dataclass(frozen=True, slots=True)
class Figure:
    """A smaller value is a better one.

    `limit` is the greatest value that keeps the promise, in `unit`, or a multiple of the floor if `times_floor`;
    None is a figure that explains another one and promises nothing.
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
        """Whether a promise is broken."""
        judged = self.ratio if self.times_floor else self.value
        return self.limit is not None and judged is not None and judged > self.limit
