# SPDX-License-Identifier: GPL-3.0-or-later
"""The range of a whole-number field in a mission record."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Range:
    """The whole numbers from `low` to `high`; `instead_of_zero` is stored where 0 has no meaning."""

    low: int
    high: int
    why: str
    instead_of_zero: int = 0

    def fit(self, value: float) -> int:
        """Truncate toward zero, then clamp; NaN and infinities count as 0."""
        return min(max(_whole(value), self.low), self.high) or self.instead_of_zero

    def reason(self, value: float) -> str:
        """The reason that `value` is not stored unchanged."""
        whole = _whole(value)
        if whole == 0 and self.instead_of_zero:
            return "0 not allowed"
        return "whole numbers only" if self.low != self.high and self.fit(value) == whole else self.why


def _whole(value: float) -> int:
    return math.trunc(value) if math.isfinite(value) else 0


UNUSED = Range(0, 0, "not used")
