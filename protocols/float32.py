# SPDX-License-Identifier: GPL-3.0-or-later
"""Single-precision arithmetic, as on a flight controller."""

import struct
from math import inf, isfinite

_FLOAT = struct.Struct("<f")


def single(value: float) -> float:
    """The nearest number that a float holds; infinity beyond the largest."""
    try:
        (rounded,) = _FLOAT.unpack(_FLOAT.pack(float(value)))
    except OverflowError:
        return inf if value > 0 else -inf
    return float(rounded)


def is_single(value: float, shown: float) -> bool:
    """True if a MISSION_ITEM, which has single precision, would carry both values as the same number."""
    return value == shown or (single(value) == single(shown) and isfinite(single(value)))
