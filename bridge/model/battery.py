# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates for a LiPo battery with known voltage only. Under load the voltage sags, and both estimates are low."""

from itertools import pairwise
from math import ceil

#: Less than any usable LiPo: the board has power from elsewhere, such as USB.
LEAST_V = 2.5
#: The highest voltage of a charged cell.
_FULL_CELL_V = 4.25
#: Volts per cell at rest -> percent remaining.
_CURVE = ((3.3, 0), (3.5, 5), (3.7, 20), (3.8, 45), (3.9, 65), (4.0, 80), (4.2, 100))


def least_cells(voltage_v: float) -> int:
    """The fewest cells that can have this voltage; right for a battery that was plugged in charged."""
    return ceil(voltage_v / _FULL_CELL_V)


def remaining_percent(voltage_v: float, cells: int) -> int:
    """The remaining charge, 0..100."""
    cell_v = voltage_v / cells
    for (low_v, low), (high_v, high) in pairwise(_CURVE):
        if cell_v < high_v:
            return round(max(low + (high - low) * (cell_v - low_v) / (high_v - low_v), 0))
    return 100
