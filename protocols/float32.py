# SPDX-License-Identifier: GPL-3.0-or-later
"""Single-precision arithmetic, as on a flight controller."""

import struct

_FLOAT = struct.Struct("<f")
#: Larger numbers cannot be packed.
_LARGEST = 3e38


def single(value: float) -> float:
    (rounded,) = _FLOAT.unpack(_FLOAT.pack(value))
    return float(rounded)


def is_single(value: float, shown: float) -> bool:
    """True if a MISSION_ITEM, which has single precision, would carry both values as the same number."""
    return value == shown or (abs(value) < _LARGEST and single(value) == single(shown))
