# SPDX-License-Identifier: GPL-3.0-or-later
"""Single-precision arithmetic, as on a flight controller."""

import struct

_FLOAT = struct.Struct("<f")
_BITS = struct.Struct("<i")
#: Larger numbers cannot be packed.
_LARGEST = 3e38


def single(value: float) -> float:
    (rounded,) = _FLOAT.unpack(_FLOAT.pack(value))
    return float(rounded)


def is_single(value: float, shown: float) -> bool:
    """True if a MISSION_ITEM, which has single precision, would carry both values as the same number."""
    return value == shown or (abs(value) < _LARGEST and single(value) == single(shown))


def neighbours(value: float) -> tuple[float, float, float]:
    """A non-zero single-precision number with its neighbours below and above."""
    (bits,) = _BITS.unpack(_FLOAT.pack(value))
    low, mid, high = (_FLOAT.unpack(_BITS.pack(bits + step))[0] for step in (-1, 0, 1))
    return low, mid, high
