# SPDX-License-Identifier: GPL-3.0-or-later
"""ArduPilot's file of all parameters, `@PARAM/param.pck` (libraries/AP_Filesystem/README.md)."""

import struct
from collections.abc import Mapping

_MAGIC = 0x671B
_FLOAT = 4
_HEADER, _VALUE = struct.Struct("<HHH"), struct.Struct("<f")
_MOST_COMMON = 15


def encode_param_pack(values: Mapping[str, float]) -> bytes:
    """The file: each value single precision, each name at most 16 characters."""
    packed, before = _HEADER.pack(_MAGIC, len(values), len(values)), b""
    for name, value in values.items():
        letters = name.encode("ascii", "replace")
        common = 0
        while common < min(len(letters) - 1, len(before), _MOST_COMMON) and letters[common] == before[common]:
            common += 1
        rest = letters[common:]
        packed += bytes((_FLOAT, common | (len(rest) - 1) << 4)) + rest + _VALUE.pack(value)
        before = letters
    return packed
