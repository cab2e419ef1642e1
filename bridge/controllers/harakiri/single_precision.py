# SPDX-License-Identifier: GPL-3.0-or-later
"""Coordinates on their way through Harakiri's MAVLink: single-precision degrees there, integers in its store.

Not every degrees * 1e7 survives that: `readable_e7` is the nearest one that reads back as it was written.
"""

import math
from itertools import chain

from protocols.float32 import neighbours, single

_E7 = single(1e7)


def readable_e7(value_e7: int) -> int:
    """The coordinate that reads back after `value_e7` is written: up to 38 less or more within 64 degrees."""
    return _read_back_e7(degrees_to_send(value_e7))


def degrees_to_send(value_e7: int) -> float:
    """The degrees in single precision whose reading is closest to `value_e7`."""
    if value_e7 == 0:
        return 0.0
    # Each of the two conversions to an integer may lose one.
    near = (neighbours(single((value_e7 + lost) / 1e7)) for lost in (0, 1, 2, -1, -2) if value_e7 + lost)
    return min(chain.from_iterable(near), key=lambda degrees: abs(_read_back_e7(degrees) - value_e7))


def degrees_read_e7(degrees: float) -> int:
    """Degrees * 1e7 as the firmware computes it: (int32_t)(degrees * 1.0e7f)."""
    return math.trunc(single(degrees * _E7))


def _read_back_e7(degrees: float) -> int:
    """The firmware stores an integer, and sends (float)integer / 1.0e7f."""
    return degrees_read_e7(single(single(degrees_read_e7(degrees)) / _E7))
